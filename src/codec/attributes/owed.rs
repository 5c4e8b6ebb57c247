//! Operations that have been carried out, of whose attributes nothing has been told (spec §13.9).

use crate::codec::refinement::MAX_STAR;
use crate::mesh::{Corner, CornerTable, Vertex};
use crate::refine::wedges::{Carried, first_of};
use crate::refine::{Site, Wedges};

/// Operations of which attributes are told together, behind the last of them. Whoever reads these goes from one kind of work to the other that
/// often: each has about as much code as the caches of processors hold.
pub const TOGETHER: usize = 64;

/// Operations of which nothing has been told.
#[derive(Debug, Default)]
pub(super) struct Owed {
    /// In order.
    pub operations: Vec<Operation>,
    /// Of those that are to be carried their stars and turned corners, one behind the other.
    corners: Vec<Corner>,
    /// How many of them have been carried.
    carried: usize,
}

/// One of them.
#[derive(Clone, Copy, Debug)]
pub(super) struct Operation {
    /// The vertex that it has inserted.
    pub vertex: Vertex,
    /// Where.
    pub site: Site,
    /// The first corner of its fan; where there is none it is to be looked for.
    pub first: Corner,
    /// How many corners its star has, new ones among them, and how many flips it had.
    star: usize,
    created: usize,
    flips: usize,
}

impl Owed {
    /// Bytes that they take at most: lists of stars and turned corners, as if they had just been copied to ones twice as long.
    pub const BYTES: usize = TOGETHER * (size_of::<Operation>() + 3 * 2 * MAX_STAR * size_of::<Corner>());

    /// Another operation has been carried out.
    #[inline]
    pub fn push(&mut self, wedges: &mut Wedges, table: &CornerTable, vertex: Vertex, carried: &Carried) {
        let (site, first) = (carried.site, first_of(table, carried));
        let (star, created, flips) = (carried.star.len(), carried.created, carried.flips.len());
        self.operations.push(Operation { vertex, site, first, star, created, flips });
        self.corners.extend_from_slice(carried.star);
        self.corners.extend_from_slice(carried.flips);
        carried.star[created..].iter().for_each(|&c| wedges.prefetch(c));
        // What these do is told by where the table ends, and where its triangles are beside.
        if !matches!(site, Site::Edge(..)) {
            self.carry(wedges, table);
        }
    }

    /// Corners take the wedges that operations leave them: by now these are in the caches.
    pub fn carry(&mut self, wedges: &mut Wedges, table: &CornerTable) {
        let mut from = 0;
        for operation in &self.operations[self.carried..] {
            let (star, behind) = (from + operation.star, from + operation.star + operation.flips);
            let (star, flips) = (&self.corners[from..star], &self.corners[star..behind]);
            wedges.carry(table, &Carried { site: operation.site, star, created: operation.created, flips });
            from = behind;
        }
        self.corners.clear();
        self.carried = self.operations.len();
    }

    /// All has been told.
    pub fn clear(&mut self) {
        self.operations.clear();
        self.carried = 0;
    }
}
