//! What is round a wedge: where the ends of its spokes are, which wedges are there, and how much each tells of it (spec §13.4).

use super::column::Column;
use super::values::Around;
use crate::codec::vector::{Vector, Vectors};
use crate::mesh::Corner;

/// The corners of a wedge, and what is at the other corners of their triangles. Its lists are used again for the next wedge.
#[derive(Clone, Debug, Default)]
pub struct Ring {
    /// The corners of the wedge.
    pub corners: Vec<Corner>,
    /// The wedges beside it: of the next and the previous corner of each triangle, in order; one for those that follow each other and are
    /// the same.
    pub beside: Vec<Beside>,
    /// Whether the last triangle lies between the last one listed and the first one.
    closes: bool,
    /// Whether one of those listed has a twin.
    has_twins: bool,
    /// The largest number of those listed.
    most: u32,
    /// Whether all of those listed are known of the column asked about last; else `some` are.
    are_all: bool,
    some: Vec<Beside>,
    /// How much each of those known tells, and whether that has been measured of all that are listed.
    shares: Vec<f32>,
    are_shared: bool,
}

/// A wedge beside another one.
#[derive(Clone, Copy, Debug)]
pub struct Beside {
    /// From the vertex of the other one to its own.
    to: Vector,
    /// Its weight: the less, the further it is away.
    weight: f32,
    /// Its number.
    pub wedge: u32,
    /// Where the other one at the same vertex is listed; [`ALONE`] if there is none.
    twin: u8,
}

/// Corners of a wedge that are looked at.
const CORNERS: usize = 64;
/// Stands for no place in the list.
const ALONE: u8 = u8::MAX;
/// The list has two for each corner.
const _: () = assert!(2 * CORNERS <= ALONE as usize);
/// Fewest neighbours that tell how values change along the surface.
const FEWEST: usize = 3;
/// What flattens a map where neighbours nearly lie in one line: a share of their spread.
const FLATTEN: f32 = 1.0 / 256.0;
/// Where they all lie in one place.
const LEAST: f32 = 1.0 / 65_536.0;

impl Ring {
    /// Bytes that one of a star takes at most: it has no more corners than are looked at, and its lists are of powers of two.
    pub const BYTES: usize =
        size_of::<Self>() + CORNERS * (4 * size_of::<Beside>() + 2 * 4 + size_of::<Corner>());

    /// Looks round a wedge of its corners, a run of the fan of its vertex; none where it is no wedge of the mesh.
    pub fn look(&mut self, around: &Around) {
        self.beside.clear();
        (self.has_twins, self.closes, self.are_shared, self.most) = (false, false, false, 0);
        let corners = &self.corners[..self.corners.len().min(CORNERS)];
        let (Some(&first), Some(&end)) = (corners.first(), corners.last()) else { return };
        let table = &around.mesh.table;
        let at = |c: Corner| around.mesh.positions[table.vertex(c).index()];
        let here = at(first);
        let (mut last, mut most) = (None, 0);
        for &c in corners {
            let wedges = around.wedges.triangle(c.triangle());
            let mut beside = |c: Corner, twin: u8| {
                let (there, wedge) = (at(c), wedges[c.place()]);
                let to = Vector::of_cell([0, 1, 2].map(|k| there[k] - here[k]));
                most = most.max(wedge);
                Beside { to, weight: 1.0 / (to.dot(to) + 1.0), wedge, twin }
            };
            let [next, prev] = [c.next(), c.prev()];
            // Its next one is at the vertex of the one listed last.
            if last.is_none() {
                self.beside.push(beside(next, ALONE));
            } else if last != Some(wedges[next.place()]) {
                let twin = self.beside.len() as u8 - 1;
                self.has_twins = true;
                self.beside.push(beside(next, twin));
            }
            self.beside.push(beside(prev, ALONE));
            last = Some(wedges[prev.place()]);
        }
        self.most = most;
        let (first, end) = (first.next(), end.prev());
        if table.vertex(first) != table.vertex(end) {
            return;
        }
        if around.wedges.of(first) != around.wedges.of(end) {
            self.beside.last_mut().into_iter().for_each(|last| last.twin = 0);
            self.has_twins = true;
            return;
        }
        self.beside.pop();
        self.closes = true;
    }

    /// The corners that are looked at.
    pub fn looked_at(&self) -> &[Corner] {
        &self.corners[..self.corners.len().min(CORNERS)]
    }

    /// At how many vertices listed, the one where an open fan begins and ends not counted, two wedges meet that `are_alike` tells apart.
    #[inline]
    pub fn parted(&self, is_open: bool, are_alike: impl Fn(u32, u32) -> bool) -> usize {
        if !self.has_twins {
            return 0;
        }
        // The last one's twin is the first, beyond the gap of an open fan.
        let closed = self.beside.len() - usize::from(is_open);
        let with_twins = self.beside[..closed].iter().filter(|beside| beside.twin != ALONE);
        with_twins
            .filter(|beside| !are_alike(self.beside[usize::from(beside.twin)].wedge, beside.wedge))
            .count()
    }

    /// Finds those that have a value, but where another one at their vertex has the same: how many wedges it is given by does not count.
    #[inline]
    pub fn know(&mut self, column: &Column) {
        self.are_all = !self.has_twins && column.are_known(self.most);
        if !self.are_all {
            self.know_some(column);
        }
    }

    fn know_some(&mut self, column: &Column) {
        self.some.clear();
        for beside in &self.beside {
            let mut is_known = column.is_known(beside.wedge);
            if is_known && beside.twin != ALONE {
                let twin = self.beside[usize::from(beside.twin)].wedge;
                is_known = column.value(twin) != Some(column.there(beside.wedge));
            }
            if is_known {
                self.some.push(*beside);
            }
        }
    }

    /// Those found.
    #[inline]
    fn known(&self) -> &[Beside] {
        if self.are_all { &self.beside } else { &self.some }
    }

    /// The wedges found.
    pub fn wedges(&self) -> impl Iterator<Item = u32> + '_ {
        self.known().iter().map(|beside| beside.wedge)
    }

    /// Tells from the vertex to the next and to the previous one, of four triangles at a time, in order. Among them are triangles of no area
    /// that the mesh has not.
    #[inline]
    pub fn each_four(&self, mut tell: impl FnMut(Vectors, Vectors)) {
        let Some(end) = (if self.closes { self.beside.first() } else { self.beside.last() }) else { return };
        let to = |at: usize| self.beside.get(at).unwrap_or(end).to;
        // Two that have no triangle between them are at one vertex.
        for at in (0..self.beside.len()).step_by(4) {
            let [a, b, c, d, e] = std::array::from_fn(|i| to(at + i));
            tell(Vectors::new([a, b, c, d]), Vectors::new([b, c, d, e]));
        }
    }

    /// The wedges found, with what each of them tells of a value that changes along the surface as steadily as may be: shares of which
    /// the sum is 1. `None` where these are too few to tell.
    #[inline]
    pub fn shares(&mut self) -> Option<impl Iterator<Item = (u32, f32)> + '_> {
        if self.known().len() < FEWEST {
            return None;
        }
        if !(self.are_all && self.are_shared) {
            self.share();
            self.are_shared = self.are_all;
        }
        Some(self.wedges().zip(self.shares.iter().copied()))
    }

    /// A linear map is fitted to those known, near ones first; what it gives at the vertex is a sum of shares of theirs.
    fn share(&mut self) {
        let known = if self.are_all { &self.beside } else { &self.some };
        let (mut whole, mut m, mut rows) = (0.0, Vector::default(), [Vector::default(); 3]);
        for &Beside { to, weight, .. } in known {
            let weighted = to * weight;
            whole += weight;
            m = m + weighted;
            for (row, x) in rows.iter_mut().zip(weighted.coordinates()) {
                *row = *row + to * x;
            }
        }
        let over = 1.0 / whole;
        let middle = m * over;
        let [a, b, c] = m.coordinates();
        let [xx, xy, xz] = (rows[0] - middle * a).coordinates();
        let [_, yy, yz] = (rows[1] - middle * b).coordinates();
        let [_, _, zz] = (rows[2] - middle * c).coordinates();
        let flat = ((xx + yy) + zz) * FLATTEN + LEAST;
        let x = Vector::new(xx + flat, xy, xz);
        let y = Vector::new(xy, yy + flat, yz);
        let z = Vector::new(xz, yz, zz + flat);
        // The inverse is these over the determinant.
        let adjoint = [y.cross(z), z.cross(x), x.cross(y)];
        let over_all = 1.0 / x.dot(adjoint[0]);
        let [u, v, w] = adjoint.map(|row| row.dot(middle) * over_all);
        let slope = Vector::new(u, v, w);
        let constant = over + slope.dot(middle);
        self.shares.clear();
        self.shares.extend(known.iter().map(|beside| beside.weight * (constant - slope.dot(beside.to))));
    }
}
