//! What reading a file will take, against what its bytes allow (spec §3.6): a decoder is not to refuse what was written for it.

use crate::codec::keyframe::Written;
use crate::error::Result;
use crate::limits::Budget;

/// The work so far, on each way into the file: from the base, and from every keyframe.
#[derive(Debug, Default)]
pub struct Work {
    ways: Vec<Budget>,
}

impl Work {
    /// A way in begins.
    ///
    /// # Errors
    /// [`Error::Limit`](crate::Error::Limit) where its bytes do not allow its work.
    pub fn enter(&mut self, written: &Written) -> Result<()> {
        let mut way = Budget::by_bytes();
        way.receive(written.payload.len());
        way.take_work(written.work)?;
        self.ways.push(way);
        Ok(())
    }

    /// Whoever has come in so far reads so many bytes, at so many units of work.
    ///
    /// # Errors
    /// [`Error::Limit`](crate::Error::Limit) where the bytes up to here do not allow it.
    pub fn read(&mut self, bytes: usize, units: u64) -> Result<()> {
        for way in &mut self.ways {
            way.receive(bytes);
            way.take_work(units)?;
        }
        Ok(())
    }

    /// The work of a whole file, from its base on.
    pub fn total(&self) -> u64 {
        self.ways.first().map_or(0, Budget::work)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Error;
    use crate::limits::{FREE_WORK, WORK_A_BYTE};

    fn way_in(bytes: usize, work: u64) -> Written {
        Written { payload: vec![0; bytes], connectivity: Default::default(), attributes: 0.0, work }
    }

    /// A keyframe that is read instead of the base has fewer bytes behind it: what the base's allow may be too much there.
    #[test]
    fn every_way_in_counts_for_itself() {
        let mut work = Work::default();
        work.enter(&way_in(100, 1000)).unwrap();
        work.read(50, FREE_WORK).unwrap();
        assert_eq!(work.total(), FREE_WORK + 1000);
        work.enter(&way_in(10, 0)).unwrap();
        work.read(0, 100 * WORK_A_BYTE).unwrap();
        let refused = work.read(0, FREE_WORK - 90 * WORK_A_BYTE + 1);
        assert!(matches!(refused, Err(Error::Limit { what: "work in steps for so few bytes", .. })));
    }

    #[test]
    fn a_base_of_nothing() {
        assert!(Work::default().enter(&way_in(1, FREE_WORK + WORK_A_BYTE + 1)).is_err());
        Work::default().enter(&way_in(1, FREE_WORK + WORK_A_BYTE)).unwrap();
    }
}
