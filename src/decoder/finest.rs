//! What level 0 has beyond its mesh: residue, attributes, correction and order, and the walk that all of them speak of, made once.

use super::Event;
use super::foreign;
use crate::codec::attributes::{self, Attributes, Nothing};
use crate::codec::correction::Correction;
use crate::codec::order::Order;
use crate::codec::residue::Residue;
use crate::codec::walk::{Tour, Walk};
use crate::codec::whole::{Whole, WholeError};
use crate::container::{AtomKind, AttributeEntry};
use crate::entropy::RangeDecoder;
use crate::error::Result;
use crate::limits::{Budget, WORK_A_SLOT};
use crate::mesh::{Attribute, IndexedMesh, Lattice};
use crate::refine::ProgressiveMesh;

/// What is known of level 0 beyond its mesh.
#[derive(Debug, Default)]
pub struct Finest {
    pub residue: Option<Residue>,
    pub correction: Option<Correction>,
    pub order: Option<Order>,
    /// The walk of level 0, once it was needed.
    tour: Option<Tour>,
    /// Level 0 with its residue, its corners at the copies of the correction, once it was needed.
    whole: Option<Whole>,
    /// Bytes debited for these two.
    held: usize,
}

/// Level 0 itself.
#[derive(Clone, Copy, Debug)]
pub struct Level0<'a> {
    pub mesh: &'a ProgressiveMesh,
    /// How many boundary edges it has.
    pub boundary: usize,
    pub lattice: &'a Lattice,
    /// What the table of contents says of the attributes that it has.
    pub entries: &'a [AttributeEntry],
}

impl Finest {
    /// Reads one of the payloads, which starts at `offset` in the file.
    ///
    /// # Errors
    /// [`Error::Format`](crate::Error::Format) and [`Error::Limit`](crate::Error::Limit).
    pub fn read(
        &mut self,
        kind: AtomKind,
        payload: &[u8],
        offset: u64,
        level0: Level0,
        attributes: &mut Attributes,
        budget: &mut Budget,
    ) -> Result<Option<Event>> {
        let (outcome, section, event) = match kind {
            AtomKind::Residue => (self.read_residue(payload, level0, budget), "8", Event::Residue),
            AtomKind::Attributes => {
                let event = Event::Attributes { level: 0 };
                (self.read_attributes(payload, level0, attributes, budget), "13", event)
            }
            // The module for pages is made without (CONTRIBUTING): neither is to be seen, and both are read by much code.
            #[cfg(unweld_surface)]
            AtomKind::Correction => return Ok(Some(Event::Correction)),
            #[cfg(unweld_surface)]
            AtomKind::Order => return Ok(Some(Event::Order)),
            #[cfg(not(unweld_surface))]
            AtomKind::Correction => (self.read_correction(payload, level0, budget), "10", Event::Correction),
            #[cfg(not(unweld_surface))]
            AtomKind::Order => (self.read_order(payload, level0, budget), "11", Event::Order),
            _ => return Ok(None),
        };
        outcome.map(|()| Some(event)).map_err(|e| e.at(offset, section))
    }

    fn read_residue(
        &mut self,
        payload: &[u8],
        level0: Level0,
        budget: &mut Budget,
    ) -> Result<(), WholeError> {
        self.walk(level0, budget)?;
        let tour = self.tour.get_or_insert_default();
        self.residue = Some(Residue::decode(payload, level0.mesh, tour, budget)?);
        Ok(())
    }

    fn read_attributes(
        &mut self,
        payload: &[u8],
        level0: Level0,
        attributes: &mut Attributes,
        budget: &mut Budget,
    ) -> Result<(), WholeError> {
        self.make_whole(level0, budget)?;
        let (tour, whole) = (self.tour.get_or_insert_default(), self.whole.get_or_insert_default());
        let none = Residue::default();
        let residue = self.residue.as_ref().unwrap_or(&none);
        let finest = attributes::Finest { mesh: level0.mesh, tour, residue, whole };
        let born: Vec<usize> = (0..level0.entries.len()).filter(|&k| level0.entries[k].birth == 0).collect();
        let mut coder = RangeDecoder::new(payload);
        attributes.finish(&born, finest, &mut coder, &Nothing, budget)?;
        coder.finish()?;
        Ok(())
    }

    #[cfg(not(unweld_surface))]
    fn read_correction(
        &mut self,
        payload: &[u8],
        level0: Level0,
        budget: &mut Budget,
    ) -> Result<(), WholeError> {
        self.make_whole(level0, budget)?;
        let whole = self.whole.get_or_insert_default();
        let correction = Correction::decode(payload, whole, level0.lattice, budget)?;
        correction.rename(&mut whole.triangles);
        self.correction = Some(correction);
        Ok(())
    }

    #[cfg(not(unweld_surface))]
    fn read_order(&mut self, payload: &[u8], level0: Level0, budget: &mut Budget) -> Result<(), WholeError> {
        self.make_whole(level0, budget)?;
        let (tour, whole) = (self.tour.get_or_insert_default(), self.whole.get_or_insert_default());
        let (none, copies) = (Residue::default(), self.correction.as_ref().map_or(0, |c| c.copies.len()));
        let (residue, count) = (self.residue.as_ref().unwrap_or(&none), whole.vertices.len() + copies);
        self.order = Some(Order::decode(payload, level0.mesh, residue, &tour.walk, whole, count, budget)?);
        Ok(())
    }

    fn walk(&mut self, level0: Level0, budget: &mut Budget) -> Result<()> {
        if self.tour.is_none() {
            budget.take_work(WORK_A_SLOT * level0.mesh.table.slots() as u64)?;
            budget.hold(&mut self.held, Tour::bytes(level0.mesh, level0.boundary))?;
            self.tour = Some(Tour::new(level0.mesh));
        }
        Ok(())
    }

    fn make_whole(&mut self, level0: Level0, budget: &mut Budget) -> Result<()> {
        self.walk(level0, budget)?;
        if let (None, Some(tour)) = (&self.whole, &self.tour) {
            let none = Residue::default();
            let residue = self.residue.as_ref().unwrap_or(&none);
            budget.take_work(WORK_A_SLOT * level0.mesh.table.slots() as u64)?;
            let more = Whole::bytes(level0.mesh, residue);
            budget.hold(&mut self.held, Tour::bytes(level0.mesh, level0.boundary) + more)?;
            self.whole = Some(Whole::new(level0.mesh, residue, tour));
        }
        Ok(())
    }

    /// Forgets what can be made again.
    pub fn forget(&mut self, budget: &mut Budget) {
        (self.tour, self.whole) = (None, None);
        budget.give_memory(self.held, 1);
        self.held = 0;
    }

    /// Level 0 with all that is known of it.
    ///
    /// # Errors
    /// [`Error::Limit`](crate::Error::Limit) where it takes more memory than is left.
    pub fn assembled(
        &self,
        level0: Level0,
        attributes: Option<(&Attributes, u32)>,
        budget: &Budget,
    ) -> Result<IndexedMesh> {
        let none = Residue::default();
        let residue = self.residue.as_ref().unwrap_or(&none);
        let mut budget = budget.clone();
        let made;
        let whole = match &self.whole {
            Some(whole) => whole,
            None => {
                made = self.whole_of(level0, residue, &mut budget)?;
                &made
            }
        };
        let vertices = whole.vertices.len() + self.correction.as_ref().map_or(0, |c| c.copies.len());
        // All at once: what is made one after the other is there together.
        let ordered = self.order.as_ref().map_or(0, |order| order.vertices.len());
        let lists =
            (vertices + ordered) * size_of::<[f64; 3]>() + whole.triangles.len() * size_of::<[u32; 3]>();
        budget.take_memory(lists, 1)?;
        let positions = match &self.correction {
            Some(correction) => correction.all_positions(),
            None => whole.positions(level0.lattice),
        };
        let mesh = match &self.order {
            Some(order) => order.apply(&positions),
            None => IndexedMesh::new(positions, whole.triangles.clone()),
        };
        let attributes = match attributes {
            Some((attributes, level)) => {
                self.foreign_attributes(level0, attributes, level, residue, &mut budget)?
            }
            None => Vec::new(),
        };
        Ok(IndexedMesh { attributes, ..mesh })
    }

    /// The attributes of a level as a source has them, at the corners of the triangles in their order.
    fn foreign_attributes(
        &self,
        level0: Level0,
        attributes: &Attributes,
        level: u32,
        residue: &Residue,
        budget: &mut Budget,
    ) -> Result<Vec<Attribute>> {
        let triangles = level0.mesh.table.triangle_count() + residue.triangles.len();
        budget.take_memory(foreign::bytes(attributes, triangles), 1)?;
        let made;
        let walk = match &self.tour {
            Some(tour) => &tour.walk,
            None => {
                budget.take_memory(Tour::bytes(level0.mesh, level0.boundary), 1)?;
                made = Walk::new(&level0.mesh.table, &level0.mesh.roots);
                &made
            }
        };
        let origins = self.order.as_ref().map(|order| &order.origins[..]);
        let of_wedges = attributes.corners(walk, residue);
        let corners = foreign::Corners { of_wedges, rows: attributes.rows(walk, residue), origins };
        let columns = level0.entries.iter().zip(&attributes.columns).enumerate();
        let alive = columns.filter(|(k, (entry, _))| attributes.is_born(*k) && entry.birth >= level);
        Ok(alive.map(|(_, (entry, column))| foreign::attribute(entry, column, &corners)).collect())
    }

    fn whole_of(&self, level0: Level0, residue: &Residue, budget: &mut Budget) -> Result<Whole> {
        let bytes = Whole::bytes(level0.mesh, residue);
        if let Some(tour) = &self.tour {
            budget.take_memory(bytes, 1)?;
            return Ok(self.renamed(Whole::new(level0.mesh, residue, tour)));
        }
        let of_tour = Tour::bytes(level0.mesh, level0.boundary);
        budget.take_memory(bytes + of_tour, 1)?;
        let whole = self.renamed(Whole::new(level0.mesh, residue, &Tour::new(level0.mesh)));
        budget.give_memory(of_tour, 1);
        Ok(whole)
    }

    /// With its corners at the copies of the correction.
    fn renamed(&self, mut whole: Whole) -> Whole {
        if let Some(correction) = &self.correction {
            correction.rename(&mut whole.triangles);
        }
        whole
    }
}
