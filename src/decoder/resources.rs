//! Resources as they arrive (spec §3.9): kept until they are taken.

use crate::container::{Contents, PackedScene, ResourceKind};
use crate::error::Result;
use crate::limits::{Budget, make_room};
use std::collections::BTreeMap;

/// The resources that are whole, and the one that is on its way.
#[derive(Debug, Default)]
pub struct Resources {
    /// By number; of the scene the JSON, inflated.
    whole: BTreeMap<usize, Vec<u8>>,
    coming: Option<Coming>,
}

/// The first atoms of a resource.
#[derive(Debug)]
struct Coming {
    number: usize,
    /// The atom that is to follow.
    next: usize,
    bytes: Vec<u8>,
    /// Bytes debited.
    held: usize,
}

impl Resources {
    /// Takes up an atom of a resource; the number of the resource if it is the last. Where those before it have not come, it is passed over.
    pub fn atom(
        &mut self,
        contents: &Contents,
        index: usize,
        payload: &[u8],
        budget: &mut Budget,
    ) -> Result<Option<usize>> {
        let Some(number) = contents.resource_of(index) else { return Ok(None) };
        let entry = &contents.resources[number];
        if index == entry.atoms.start {
            self.forget_coming(budget);
            self.coming = Some(Coming { number, next: index, bytes: Vec::new(), held: 0 });
        }
        let Some(coming) = self.coming.as_mut().filter(|it| it.number == number && it.next == index) else {
            return Ok(None);
        };
        coming.next += 1;
        let (have, whole) = (coming.bytes.len(), usize::try_from(entry.bytes).unwrap_or(usize::MAX));
        if have + payload.len() > coming.bytes.capacity() {
            // No more than has arrived, and no more than there will be.
            let more = payload.len().max(have).min(whole - have);
            budget.exchange(&mut coming.held, have + more)?;
            make_room(&mut coming.bytes, more)?;
        }
        coming.bytes.extend_from_slice(payload);
        if coming.next < entry.atoms.end {
            return Ok(None);
        }
        let bytes = std::mem::take(&mut coming.bytes);
        let outcome = self.keep(contents, number, bytes, budget);
        self.coming = None;
        outcome.map(|()| Some(number))
    }

    /// Keeps a resource that is whole, and has been debited; the memory of one that was there before is given back.
    fn keep(
        &mut self,
        contents: &Contents,
        number: usize,
        bytes: Vec<u8>,
        budget: &mut Budget,
    ) -> Result<()> {
        let entry = &contents.resources[number];
        let bytes = match entry.kind {
            ResourceKind::Scene => {
                let packed = PackedScene::read(&bytes, contents.bytes(entry.atoms.clone()).start)?;
                let json = inflated(packed, budget)?;
                budget.give_memory(bytes.len(), 1);
                json
            }
            ResourceKind::Buffer => bytes,
        };
        if let Some(before) = self.whole.insert(number, bytes) {
            budget.give_memory(before.len(), 1);
        }
        Ok(())
    }

    /// Keeps a resource whose bytes have come by another way.
    pub fn add(
        &mut self,
        contents: &Contents,
        number: usize,
        bytes: &[u8],
        budget: &mut Budget,
    ) -> Result<()> {
        contents.check_resource(number, bytes)?;
        budget.receive(bytes.len());
        budget.take_memory(bytes.len(), 1)?;
        let outcome = self.keep(contents, number, bytes.to_vec(), budget);
        outcome.inspect_err(|_| budget.give_memory(bytes.len(), 1))
    }

    /// The bytes of a resource that is whole.
    pub fn get(&self, number: usize) -> Option<&[u8]> {
        self.whole.get(&number).map(Vec::as_slice)
    }

    /// Hands over a resource that is whole.
    pub fn take(&mut self, number: usize, budget: &mut Budget) -> Option<Vec<u8>> {
        let bytes = self.whole.remove(&number)?;
        budget.give_memory(bytes.len(), 1);
        Some(bytes)
    }

    fn forget_coming(&mut self, budget: &mut Budget) {
        if let Some(coming) = self.coming.take() {
            budget.give_memory(coming.held, 1);
        }
    }
}

/// The JSON of a scene; the budget is as it was where there is none.
fn inflated(packed: PackedScene, budget: &mut Budget) -> Result<Vec<u8>> {
    let length = packed.length as usize;
    budget.take_work(packed.length.into())?;
    budget.take_memory(length, 1)?;
    packed.json().inspect_err(|_| budget.give_memory(length, 1))
}
