//! The star of a new vertex: the split of an edge, the flips of its link edges, what the triangles round it are told (spec §5.3).

use super::flips::Ring;
use super::{Answers, FEW, LevelPass, MAX_STAR, QUEUE, RefinementError, STAR, Under};
use crate::codec::context::{self, Shape};
use crate::codec::extents::{Spokes, length_squared, squares_from};
use crate::codec::lift::minus;
use crate::codec::position::Surroundings;
use crate::codec::vector::{Vector, truncate};
use crate::entropy::BitCoder;
use crate::mesh::prefetch::prefetch;
use crate::mesh::{Corner, CornerTable, Vertex};
use crate::refine::{ProgressiveMesh, Root, Site, stellar};

/// A link edge that may be flipped.
#[derive(Clone, Copy, Debug)]
pub(super) struct LinkEdge {
    /// The corner at the new vertex.
    corner: Corner,
    /// The one beyond, and its vertex.
    beyond: Corner,
    far: Vertex,
    shape: Shape,
}

impl LinkEdge {
    pub(super) const NONE: Self = Self {
        corner: Corner::NONE,
        beyond: Corner::NONE,
        far: Vertex::NONE,
        shape: Shape { angle: 0, bend: 0 },
    };
}

/// What a star under way adds up to.
#[derive(Debug)]
struct Star {
    /// The ends of the edge that was split.
    ends: [Vertex; 2],
    /// The root edge of its component.
    root: Root,
    /// Whether it has lost that edge.
    uproots: bool,
    spokes: Spokes,
}

impl LevelPass {
    /// Splits the edge opposite to `k`: its position, then its flips.
    pub(super) fn split<C: BitCoder, A: Answers>(
        &mut self,
        under: &mut Under<C, A>,
        k: Corner,
    ) -> Result<(), RefinementError> {
        let table = &under.mesh.table;
        let [left, a, b] = table.vertices_from(k);
        let [o, beyond_bl, beyond_la] = table.opposites_from(k);
        let (mut right, mut beyond) = (left, [beyond_bl, beyond_la, Corner::NONE, Corner::NONE]);
        if o.is_some() {
            let [_, beyond_ar, beyond_rb] = table.opposites_from(o);
            right = table.vertex(o);
            beyond = [beyond_bl, beyond_la, beyond_ar, beyond_rb];
        }
        if self.cells.lifting > 0 {
            // What lifts move is looked at once the position is known.
            for w in [a, b, left, right] {
                prefetch(&under.mesh.positions[w.index()]);
            }
        }
        // Where there is nothing beyond, anything will do.
        let far = beyond.map(|c| if c.is_some() { table.vertex(c) } else { a });
        let [at_a, at_b, at_left, at_right] = [a, b, left, right].map(|v| self.extents.cell(v));
        let at_far = far.map(|v| self.extents.cell(v));
        let mut wings = (Vector::default(), 0.0);
        for (&c, &at) in beyond.iter().zip(&at_far) {
            if c.is_some() {
                wings = (wings.0 + (at - at_a), wings.1 + 1.0);
            }
        }
        let around = Surroundings {
            start: at_a.coordinates().map(truncate),
            edge: at_b - at_a,
            left: at_left - at_a,
            right: o.is_some().then(|| at_right - at_a),
            wings,
        };
        let (v, position) =
            self.code_vertex(under, |models, coder, known| models.split(coder, &around, known))?;
        let lift = if o.is_some() { self.lift(under.mesh, [a, b, left, right], position)? } else { None };
        let (corners, count) = stellar::split_edge(&mut under.mesh.table, k, v);
        self.place(under.mesh, v, position);
        self.begin(&under.mesh.table, v, Site::Edge(a, b), count / 2);
        if let Some(by) = lift {
            // Only here: what is predicted goes on from where they were when the level began.
            for w in [a, b, v] {
                let place = &mut under.mesh.positions[w.index()];
                *place = minus(*place, by);
            }
            self.inserted.lift = lift;
            self.lifts += 1;
            if self.lifted.len() < under.mesh.positions.len() / FEW {
                self.lifted.push([a, b, v]);
            }
        }
        let [new_left, old_left, new_right, old_right] = corners;
        if o.is_some() {
            self.star(&[new_left, new_right, old_left, old_right]);
        } else {
            self.star(&[new_left, old_left]);
        }
        let root = under.mesh.roots.of(a);
        let mut star = Star { ends: [a, b], root, uproots: root.is(a, b), spokes: Spokes::default() };
        let at_v = self.extents.cell(v);
        let square = length_squared(at_b - at_a);
        let squares = squares_from(at_v, [at_a, at_b, at_left, at_right]);
        star.spokes.count(self.extents.join(a, v, squares[0], square));
        star.spokes.count(self.extents.join(b, v, squares[1], square));
        star.spokes.count(self.extents.meet(left, v, squares[2]));
        if o.is_some() {
            star.spokes.count(self.extents.meet(right, v, squares[3]));
        }
        let next = [at_left, at_a, at_right, at_b];
        let shapes = context::link_edges(at_v, [at_b, at_left, at_a, at_right], next, at_far);
        let mut tail = 0;
        for i in 0..count {
            self.queue[tail] =
                LinkEdge { corner: corners[i], beyond: beyond[i], far: far[i], shape: shapes[i] };
            tail += usize::from(beyond[i].is_some());
        }
        self.flips(under, v, &mut star, tail);
        self.extents.settle(v, star.spokes);
        under.mesh.roots.insert(&under.mesh.table, v, a, star.uproots);
        Ok(())
    }

    /// By how much the split of an interior edge a–b, with c on its left and d on its right, moves its ends and the new vertex, which
    /// is coded to lie at `position`; `None` where they stay.
    #[inline]
    fn lift(
        &self,
        mesh: &ProgressiveMesh,
        [a, b, c, d]: [Vertex; 4],
        position: [i32; 3],
    ) -> Result<Option<[i32; 3]>, RefinementError> {
        if self.cells.lifting == 0 {
            return Ok(None);
        }
        let [at_a, at_b, at_c, at_d] = [a, b, c, d].map(|w| mesh.positions[w.index()]);
        let by = self.cells.lift([at_a, at_b, at_c, at_d], position);
        let on_boundary = |w: Vertex| mesh.table.is_boundary(w);
        if by == [0; 3] || !self.boundary.is_empty() && (on_boundary(a) || on_boundary(b)) {
            return Ok(None);
        }
        for place in [at_a, at_b, position].map(|p| minus(p, by)) {
            if !self.holds(place.map(|x| x >> self.cells.precision)) {
                return Err(RefinementError::OffLattice(place));
            }
        }
        Ok(Some(by))
    }

    /// Asks, first in first out, for the flips of the link edges of `v`, of which the first `tail` stand in the queue. Those that
    /// stay have a star beyond from now on.
    #[inline]
    fn flips<C: BitCoder, A: Answers>(
        &mut self,
        under: &mut Under<C, A>,
        v: Vertex,
        star: &mut Star,
        mut tail: usize,
    ) {
        let at_v = self.extents.cell(v);
        let mut head = 0;
        while head < tail {
            let LinkEdge { corner: c, beyond: o, far: r, shape } = self.queue[head & (QUEUE - 1)];
            head += 1;
            let state = self.states[o.triangle().index()];
            if state == STAR {
                continue;
            }
            let asked = self.extents.at(r).linked != v && self.inserted.star.len() < MAX_STAR;
            let (p, q) = under.mesh.table.edge(c);
            let ring = Ring {
                flips: self.inserted.flips.len(),
                closed: state,
                ends: [self.extents.at(p).edges, self.extents.at(q).edges],
                far: self.extents.at(r).edges,
                end: usize::from(star.ends.contains(&p)) + 2 * usize::from(star.ends.contains(&q)),
            };
            let cells = || [v, p, q, r].map(|w| self.extents.cell(w));
            let known = || under.answers.flip(&under.mesh.table, c);
            if !asked || !under.models.flip.code(under.coder, shape, (ring, self.flips_by_rows), cells, known)
            {
                self.states[o.triangle().index()] = state + 1;
                continue;
            }
            let other = stellar::flip(&mut under.mesh.table, c);
            let table = &under.mesh.table;
            let beyond = [c, other].map(|c| table.opposite(c));
            let far = beyond.map(|o| if o.is_some() { table.vertex(o) } else { r });
            let [at_p, at_q, at_r] = [p, q, r].map(|w| self.extents.cell(w));
            let [first, second] = far.map(|w| self.extents.cell(w));
            let shapes = context::link_edges(
                at_v,
                [at_p, at_r, at_p, at_r],
                [at_r, at_q, at_r, at_q],
                [first, second, first, second],
            );
            let link_edge =
                |corner, i: usize| LinkEdge { corner, beyond: beyond[i], far: far[i], shape: shapes[i] };
            self.queue[tail & (QUEUE - 1)] = link_edge(c, 0);
            tail += usize::from(beyond[0].is_some());
            self.queue[tail & (QUEUE - 1)] = link_edge(other, 1);
            tail += usize::from(beyond[1].is_some());
            self.extents.part(p, q, length_squared(at_q - at_p));
            star.spokes.count(self.extents.meet(r, v, length_squared(at_r - at_v)));
            star.uproots |= star.root.is(p, q);
            self.star(&[other]);
            self.inserted.flips.push([p, q]);
            self.inserted.turned.push(c);
        }
    }

    /// `v` has been inserted, so far without flips; the triangles that are new are in its star.
    pub(super) fn begin(&mut self, table: &CornerTable, v: Vertex, site: Site, created: usize) {
        self.states.resize(table.slots(), STAR);
        self.inserted.vertex = v;
        self.inserted.site = site;
        self.inserted.flips.clear();
        self.inserted.turned.clear();
        self.inserted.star.clear();
        self.inserted.created = created;
        self.inserted.lift = None;
    }

    /// Counts the triangles of some corners at the new vertex to its star.
    #[inline(always)]
    pub(super) fn star(&mut self, corners: &[Corner]) {
        for c in corners {
            self.states[c.triangle().index()] = STAR;
        }
        self.inserted.star.extend_from_slice(corners);
    }

    /// The star of an operation without flips is complete: counts its edges, and tells the triangles round it.
    pub(super) fn end(&mut self, mesh: &mut ProgressiveMesh, beside: Vertex) {
        let v = self.inserted.vertex;
        mesh.roots.insert(&mesh.table, v, beside, false);
        let mut spokes = Spokes::default();
        let mut meet = |w: Vertex| {
            let square = length_squared(self.extents.cell(w) - self.extents.cell(v));
            spokes.count(self.extents.meet(w, v, square));
        };
        for &c in &self.inserted.star {
            let [_, p, q] = mesh.table.vertices_from(c);
            let [beyond, behind, _] = mesh.table.opposites_from(c);
            if let Some(state) = self.states.get_mut(beyond.triangle().index()) {
                *state += u8::from(*state != STAR);
            }
            meet(p);
            if behind.is_none() {
                meet(q);
            }
        }
        self.extents.settle(v, spokes);
    }
}
