//! One operation: the split, face split or attachment that inserts one vertex, with all its flips (spec §5.1).

use super::stellar;
use crate::mesh::{Corner, CornerTable, Vertex};

/// Where an operation inserts its vertex.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Site {
    /// On the edge a–b; the first triangle runs along it from a to b. Interior or boundary edge.
    Edge(Vertex, Vertex),
    /// In the triangle (a, b, c).
    Face(Vertex, Vertex, Vertex),
    /// Outside the boundary edge a→b.
    Attach(Vertex, Vertex),
}

/// One vertex's insertion. Its flips lie in a pool of the [`super::History`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Operation {
    /// The vertex inserted.
    pub vertex: Vertex,
    /// Where.
    pub site: Site,
    /// The first of its flips in the pool.
    pub first_flip: u32,
    /// Number of its flips.
    pub flip_count: u32,
}

/// Why an operation does not fit a mesh; the mesh is then as far as the flips before the fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum OperationError {
    /// A vertex is out of range, missing, or already there.
    #[error("vertex {0:?} is missing or already in use")]
    Vertex(Vertex),
    /// The site does not exist, or is not of the kind named.
    #[error("there is no such site {0:?}")]
    Site(Site),
    /// A flip's link edge does not exist or cannot be flipped.
    #[error("the link edge of {0:?} starting at {1:?} cannot be flipped")]
    Flip(Vertex, Vertex),
    /// The edge to be made exists already.
    #[error("the edge {0:?} {1:?} exists already")]
    EdgeExists(Vertex, Vertex),
    /// The triangle to be made exists already.
    #[error("the triangle of {0:?} exists already")]
    TriangleExists(Vertex),
    /// The star of the vertex is not the one the operation leaves.
    #[error("the star of {0:?} does not fit the operation")]
    Star(Vertex),
}

impl Operation {
    /// Inserts the vertex: the site's split, then the flips, each given by the start p of its link edge p→q, in order.
    ///
    /// # Errors
    /// [`OperationError`] where the mesh does not allow it; nothing panics, whatever the operation says.
    pub fn apply(&self, table: &mut CornerTable, flips: &[Vertex]) -> Result<(), OperationError> {
        let v = self.vertex;
        // A vertex number far beyond the end would make the corner array grow without reason.
        if v.index() > table.vertex_slots() || (v.index() < table.vertex_slots() && is_used(table, v)) {
            return Err(OperationError::Vertex(v));
        }
        let missing = OperationError::Site(self.site);
        match self.site {
            Site::Edge(a, b) => {
                let k = directed_edge(table, a, b).ok_or(missing)?;
                stellar::split_edge(table, k, v);
            }
            Site::Face(a, b, c) => {
                let k = directed_edge(table, a, b).filter(|&k| table.vertex(k) == c).ok_or(missing)?;
                stellar::split_face(table, k.next(), v);
            }
            Site::Attach(a, b) => {
                let k = directed_edge(table, a, b).filter(|&k| table.opposite(k).is_none()).ok_or(missing)?;
                stellar::attach(table, k, v);
            }
        }
        for &p in flips {
            let fault = OperationError::Flip(v, p);
            let c = table.fan(v).find(|&c| table.vertex(c.next()) == p).ok_or(fault)?;
            let o = table.opposite(c);
            if o.is_none() {
                return Err(fault);
            }
            let r = table.vertex(o);
            if r == v || table.has_edge(v, r) {
                return Err(OperationError::EdgeExists(v, r));
            }
            stellar::flip(table, c);
        }
        Ok(())
    }

    /// Removes the vertex: the flips backwards, then the weld or removal. The exact inverse of [`Operation::apply`].
    ///
    /// # Errors
    /// [`OperationError`] where the mesh does not allow it; nothing panics, whatever the operation says.
    pub fn undo(&self, table: &mut CornerTable, flips: &[Vertex]) -> Result<(), OperationError> {
        self.undo_where(table, flips, |table, a, b| !table.has_edge(a, b))
    }

    /// [`Operation::undo`], asking `may_join` whether an edge between two vertices may be made: a caller that has looked at them
    /// already says yes.
    ///
    /// # Errors
    /// As [`Operation::undo`].
    pub fn undo_where(
        &self,
        table: &mut CornerTable,
        flips: &[Vertex],
        may_join: impl Fn(&CornerTable, Vertex, Vertex) -> bool,
    ) -> Result<(), OperationError> {
        let v = self.vertex;
        if !is_used(table, v) {
            return Err(OperationError::Vertex(v));
        }
        for &p in flips.iter().rev() {
            let fault = OperationError::Flip(v, p);
            let c = table.fan(v).find(|&c| table.vertex(c.next()) == p).ok_or(fault)?;
            let beyond = table.opposite(c.next());
            if beyond.is_none() {
                return Err(fault);
            }
            let q = table.vertex(beyond);
            if q == p {
                return Err(OperationError::Star(v));
            }
            if !may_join(table, p, q) {
                return Err(OperationError::EdgeExists(p, q));
            }
            stellar::unflip(table, c);
        }
        self.undo_site(table, may_join)
    }

    fn undo_site(
        &self,
        table: &mut CornerTable,
        may_join: impl Fn(&CornerTable, Vertex, Vertex) -> bool,
    ) -> Result<(), OperationError> {
        let v = self.vertex;
        let star = OperationError::Star(v);
        let (triangles, boundary) = (table.fan(v).count(), table.is_boundary(v));
        match self.site {
            Site::Edge(a, b) => {
                if triangles != if boundary { 2 } else { 4 } {
                    return Err(star);
                }
                // (c, a, v): the corner at v whose previous vertex is a, and whose left triangle leads to b.
                let s = table.fan(v).find(|&s| table.vertex(s.prev()) == a).ok_or(star)?;
                let k = s.next();
                let far = table.opposite(k.next());
                if far.is_none() || table.vertex(far) != b {
                    return Err(star);
                }
                if !boundary && table.vertex(k) == table.vertex(table.opposite(k)) {
                    return Err(star);
                }
                if !may_join(table, a, b) {
                    return Err(OperationError::EdgeExists(a, b));
                }
                stellar::weld_edge(table, k);
            }
            Site::Face(a, b, c) => {
                if triangles != 3 || boundary {
                    return Err(star);
                }
                let s = table.fan(v).find(|&s| table.vertex(s.next()) == a).ok_or(star)?;
                if table.vertex(s.prev()) != b || table.vertex(table.opposite(s.next())) != c {
                    return Err(star);
                }
                if has_triangle(table, [a, b, c]) {
                    return Err(OperationError::TriangleExists(v));
                }
                stellar::weld_face(table, s.next());
            }
            Site::Attach(a, b) => {
                let ear = table.corner_of(v);
                let inner = table.opposite(ear);
                if triangles != 1 || inner.is_none() || table.edge(ear) != (b, a) {
                    return Err(star);
                }
                stellar::detach(table, v);
            }
        }
        Ok(())
    }
}

/// Whether a triangle with these vertices, in either orientation, exists.
pub fn has_triangle(table: &CornerTable, [a, b, c]: [Vertex; 3]) -> bool {
    let k = table.find_edge(a, b);
    if k.is_none() {
        return false;
    }
    let o = table.opposite(k);
    table.vertex(k) == c || (o.is_some() && table.vertex(o) == c)
}

fn is_used(table: &CornerTable, v: Vertex) -> bool {
    v.index() < table.vertex_slots() && table.corner_of(v).is_some()
}

fn directed_edge(table: &CornerTable, a: Vertex, b: Vertex) -> Option<Corner> {
    let used = is_used(table, a) && is_used(table, b);
    used.then(|| table.find_directed_edge(a, b)).filter(|k| k.is_some())
}
