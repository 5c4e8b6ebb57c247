//! stub
use super::column::Column;
use crate::entropy::{BitCoder, CodingError, NumberModel};
use crate::mesh::Corner;
use crate::mesh::attributes::Kind;
use crate::refine::{ProgressiveMesh, Wedges};

pub struct Around<'a> {
    pub mesh: &'a ProgressiveMesh,
    pub wedges: &'a Wedges,
}

pub struct ValueModels(Vec<NumberModel>);

impl ValueModels {
    pub fn new(kind: &Kind) -> Self {
        Self(vec![NumberModel::default(); kind.integers()])
    }
    pub fn code<C: BitCoder>(
        &mut self,
        coder: &mut C,
        _around: &Around,
        column: &Column,
        _corners: &[Corner],
        _before: Option<u32>,
        truth: &[i32],
    ) -> Result<Vec<i32>, CodingError> {
        let last =
            column.count().checked_sub(1).and_then(|last| column.value(last as u32)).map(<[i32]>::to_vec);
        let mut out = Vec::new();
        for (k, model) in self.0.iter_mut().enumerate() {
            let p = last.as_ref().map_or(0, |last| last[k]);
            let t = truth.get(k).copied().unwrap_or(0);
            out.push(p.wrapping_add(model.unsigned(coder, || t.wrapping_sub(p) as u32)? as i32));
        }
        Ok(out)
    }
}
