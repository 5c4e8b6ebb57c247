//! Chapter 13.3: the values of an attribute, one after the other.

use std::collections::BTreeMap;

use super::attribute::Attribute;
use super::container::Result;
use super::entropy::{Code, Model};
use super::expected::Values;
use super::numbers::{Value, integers};
use super::walk::{Edge, Mesh};

/// The models of an attribute.
pub struct Column {
    pub about: Attribute,
    same: [Model; 2],
    present: [Model; 2],
    last: bool,
    models: Values,
}

/// Where a value is.
pub struct Place<'a> {
    pub mesh: &'a Mesh,
    /// The wedges of corners.
    pub of: &'a BTreeMap<Edge, usize>,
    /// The attribute's values, by wedge.
    pub values: &'a BTreeMap<usize, Value>,
    pub corners: &'a [Edge],
}

impl Column {
    pub fn fresh(about: &Attribute) -> Self {
        Self {
            same: [Model::FRESH; 2],
            present: [Model::FRESH; 2],
            last: true,
            models: Values::fresh(about),
            about: about.clone(),
        }
    }

    /// The value of a wedge, or of what is none; p is the value of the wedge before.
    pub fn read(
        &mut self,
        code: &mut Code,
        at: &Place,
        wedge: Option<usize>,
        p: Option<&Value>,
    ) -> Result<Value> {
        let is_partial = self.about.marks / 4 % 2 == 1;
        let (mut value, mut lengths) = (None, vec![0; integers(&self.about)]);
        if let Some(p) = p
            && code.read(&mut self.same[usize::from(is_partial && !self.last)])?
        {
            value = p.clone();
        } else {
            if is_partial {
                self.last = code.read(&mut self.present[usize::from(self.last)])?;
            }
            if !is_partial || self.last {
                let told = self.models.read(code, at, p.and_then(Option::as_ref), &self.about)?;
                (value, lengths) = (Some(told.0), told.1);
            }
        }
        self.models.told(wedge, lengths);
        Ok(value)
    }
}
