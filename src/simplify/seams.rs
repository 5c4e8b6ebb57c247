//! Feature edges inside a mesh: where charts of an attribute meet, which removals leave standing.
//!
//! A chart's border is made of curves that end in corners. A vertex with two seams is removed along its curve, a–v–b becoming a–b on both
//! sides at once; where a seam ends, where several meet, and where one meets the boundary, the vertex stays. Then no triangle ever has
//! corners in two charts, curves are only shortened, and a vertex is of as many charts at each level that it is in.

use crate::error::{Error, Result};
use crate::mesh::topology::{VertexClass, classify};
use crate::mesh::{Corner, CornerTable, Triangle, Vertex};
use bitvec::vec::BitVec;

/// What a simplification keeps besides locked vertices and the boundary.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Features {
    /// Borders of charts: a bit a corner number, four a triangle, set at one or both sides of a seam for the edge opposite; empty where
    /// there are none.
    pub seams: BitVec,
}

/// The seams of a mesh that loses its vertices.
#[derive(Debug)]
pub struct Seams {
    /// By corner number, for the edge opposite; the same on both sides. Boundary edges are none.
    of: BitVec,
    /// Vertices inside the mesh that are on a curve. A vertex that stays stays on it.
    curved: BitVec,
    /// Vertices where feature edges end or several of them meet.
    corners: BitVec,
}

impl Seams {
    /// Those of a mesh; `None` where it has none.
    ///
    /// # Errors
    /// [`Error::Parameter`] where there are bits, but not four a triangle.
    pub fn new(table: &CornerTable, features: Features) -> Result<Option<Self>> {
        let mut of = features.seams;
        if of.not_any() {
            return Ok(None);
        }
        if of.len() != 4 * table.slots() {
            return Err(Error::Parameter(format!("{} seams for {} triangles", of.len(), table.slots())));
        }
        for c in table.triangles().flat_map(|t| t.corners()) {
            let o = table.opposite(c);
            let is_seam = o.is_some() && (of[c.index()] || of[o.index()]);
            of.set(c.index(), is_seam);
        }
        let classes = classify(table, &of);
        let corners = classes.iter().map(|&class| class == VertexClass::Corner).collect();
        let on_curve = |(v, class)| class == VertexClass::Curve && !table.is_boundary(Vertex(v));
        let curved = (0..).zip(classes).map(on_curve).collect();
        Ok(Some(Self { of, curved, corners }))
    }

    /// The vertices that must stay for them.
    pub fn corners(&self) -> &BitVec {
        &self.corners
    }

    /// Whether the edge opposite to a corner is a seam.
    #[inline]
    pub fn is_seam(&self, c: Corner) -> bool {
        self.of[c.index()]
    }

    /// The places on the link of `v`, a vertex inside the mesh, that its curve comes from and leads to; `None` where it is on none.
    #[inline]
    pub fn curve(&self, table: &CornerTable, v: Vertex) -> Option<(usize, usize)> {
        if !self.curved[v.index()] {
            return None;
        }
        let spokes = table.fan(v).enumerate().filter(|(_, c)| self.is_seam(c.prev()));
        let mut places = spokes.map(|(place, _)| place);
        let curve = places.next().zip(places.next());
        debug_assert!(curve.is_some() && places.next().is_none(), "a curve goes on on both sides");
        curve
    }

    /// Some triangles are new, in place of a star; between them only the edge between the ends of `curve` is a seam.
    pub fn renew(&mut self, table: &CornerTable, triangles: &[Triangle], curve: Option<[Vertex; 2]>) {
        for c in triangles.iter().flat_map(|t| t.corners()) {
            let o = table.opposite(c);
            let is_seam = if o.is_none() {
                false
            } else if triangles.contains(&o.triangle()) {
                let (a, b) = table.edge(c);
                curve.is_some_and(|ends| ends == [a, b] || ends == [b, a])
            } else {
                self.is_seam(o)
            };
            self.of.set(c.index(), is_seam);
        }
    }
}
