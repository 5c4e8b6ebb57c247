//! What is round a wedge: where the ends of its spokes are, which wedges are there, and how much each tells of it (spec §13.4).

use super::column::Column;
use super::values::Around;
use crate::mesh::Corner;

/// The corners of a wedge, and what is at the other corners of their triangles. Its lists are used again for the next wedge.
#[derive(Clone, Debug, Default)]
pub struct Ring {
    /// The corners of the wedge, [`CORNERS`] at most.
    pub corners: Vec<Corner>,
    /// The wedges beside it: of the next and the previous corner of each triangle, in order; one for those that follow each other and are
    /// the same.
    pub beside: Vec<Beside>,
    /// By corner, where its next and its previous one are listed.
    faces: Vec<[u8; 2]>,
    /// How much each listed one tells, those that are known being in `of`.
    shares: Vec<f64>,
    /// Bits of those that are known.
    of: u128,
    /// Whether `shares` are those of `of`.
    is_shared: bool,
}

/// A wedge beside another one.
#[derive(Clone, Copy, Debug)]
pub struct Beside {
    /// Its number.
    pub wedge: u32,
    /// From the vertex of the other one to its own.
    pub to: [f64; 3],
    /// Where the other one at the same vertex is listed, if there is one.
    twin: Option<u8>,
}

/// Corners of a wedge that are looked at.
const CORNERS: usize = 64;
/// As many can be told apart by two corners each.
const _: () = assert!(2 * CORNERS <= u128::BITS as usize);
/// Fewest neighbours that tell how values change along the surface.
const FEWEST: u32 = 3;
/// What flattens a map where neighbours nearly lie in one line: a share of their spread.
const FLATTEN: f64 = 1.0 / 256.0;
/// Where they all lie in one place.
const LEAST: f64 = 1.0 / 1_048_576.0;

impl Ring {
    /// Looks round a wedge of these corners, a run of the fan of its vertex; none where it is no wedge of the mesh.
    #[inline]
    pub fn look(&mut self, around: &Around, corners: &[Corner]) {
        let corners = &corners[..corners.len().min(CORNERS)];
        self.corners.clear();
        self.corners.extend_from_slice(corners);
        self.beside.clear();
        self.faces.clear();
        self.is_shared = false;
        let Some(&first) = corners.first() else { return };
        let table = &around.mesh.table;
        let at = |c: Corner| around.mesh.positions[table.vertex(c).index()];
        let here = at(first);
        for &c in corners {
            let beside = |c: Corner| {
                let there = at(c);
                let to = [0, 1, 2].map(|k| f64::from(there[k]) - f64::from(here[k]));
                Beside { wedge: around.wedges.of(c), to, twin: None }
            };
            // Its next one is at the vertex of the one listed last.
            let next = around.wedges.of(c.next());
            if self.beside.last().is_none_or(|last| last.wedge != next) {
                let twin = (self.beside.len() as u8).checked_sub(1);
                self.beside.push(Beside { twin, ..beside(c.next()) });
            }
            self.beside.push(beside(c.prev()));
            let last = self.beside.len() as u8 - 1;
            self.faces.push([last - 1, last]);
        }
        let (first, last) = (self.corners[0].next(), self.corners[corners.len() - 1].prev());
        if table.vertex(first) != table.vertex(last) {
            return;
        }
        if around.wedges.of(first) != around.wedges.of(last) {
            self.beside.last_mut().into_iter().for_each(|last| last.twin = Some(0));
            return;
        }
        self.beside.pop();
        self.faces.last_mut().into_iter().for_each(|face| face[1] = 0);
    }

    /// Bits of those that have a value, but where another one at their vertex has the same: how many wedges it is given by does not count.
    #[inline]
    fn known(&self, column: &Column) -> u128 {
        let mut of = 0;
        for (place, beside) in self.beside.iter().enumerate() {
            let mut is_known = column.is_known(beside.wedge);
            if let Some(twin) = beside.twin {
                let twin = self.beside[usize::from(twin)].wedge;
                is_known = is_known && column.value(twin) != column.value(beside.wedge);
            }
            of |= u128::from(is_known) << place;
        }
        of
    }

    /// The wedges that have values.
    pub fn wedges(&self, column: &Column) -> impl Iterator<Item = u32> + '_ {
        let of = self.known(column);
        let all = self.beside.iter().enumerate();
        all.filter(move |(place, _)| of >> place & 1 == 1).map(|(_, beside)| beside.wedge)
    }

    /// From the vertex to the next and to the previous one, of each triangle.
    pub fn sides(&self) -> impl Iterator<Item = [[f64; 3]; 2]> + '_ {
        self.faces.iter().map(|face| face.map(|place| self.beside[usize::from(place)].to))
    }

    /// The known ones beside, with what each of them tells of a value that changes along the surface as steadily as may be: shares of which
    /// the sum is 1. `None` where these are too few to tell.
    #[inline]
    pub fn shares<'a>(&'a mut self, column: &'a Column) -> Option<impl Iterator<Item = (u32, f64)> + 'a> {
        let of = self.known(column);
        if of.count_ones() < FEWEST {
            return None;
        }
        if !self.is_shared || self.of != of {
            self.of = of;
            self.is_shared = true;
            self.share();
        }
        let all = self.beside.iter().zip(&self.shares).enumerate();
        Some(
            all.filter(move |(place, _)| of >> place & 1 == 1)
                .map(|(_, (beside, &share))| (beside.wedge, share)),
        )
    }

    /// A linear map is fitted to those known, near ones first; what it gives at the vertex is a sum of shares of theirs.
    fn share(&mut self) {
        self.shares.clear();
        let (mut whole, mut m) = (0.0, [0.0; 3]);
        let (mut xx, mut xy, mut xz, mut yy, mut yz, mut zz) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        for (place, beside) in self.beside.iter().enumerate() {
            let [x, y, z] = beside.to;
            if self.of >> place & 1 == 0 {
                self.shares.push(0.0);
                continue;
            }
            let w = 1.0 / (((x * x + y * y) + z * z) + 1.0);
            self.shares.push(w);
            whole += w;
            m = [m[0] + w * x, m[1] + w * y, m[2] + w * z];
            let [a, b, c] = [w * x, w * y, w * z];
            (xx, xy, xz) = (xx + a * x, xy + a * y, xz + a * z);
            (yy, yz, zz) = (yy + b * y, yz + b * z, zz + c * z);
        }
        let over = 1.0 / whole;
        let [x, y, z] = m.map(|m| m * over);
        (xx, xy, xz) = (xx - m[0] * x, xy - m[0] * y, xz - m[0] * z);
        (yy, yz, zz) = (yy - m[1] * y, yz - m[1] * z, zz - m[2] * z);
        let flat = ((xx + yy) + zz) * FLATTEN + LEAST;
        (xx, yy, zz) = (xx + flat, yy + flat, zz + flat);
        // The inverse is these over the determinant.
        let (a, b, c) = (yy * zz - yz * yz, yz * xz - xy * zz, xy * yz - xz * yy);
        let (d, e, f) = (xx * zz - xz * xz, xy * xz - xx * yz, xx * yy - xy * xy);
        let over_all = 1.0 / ((xx * a + xy * b) + xz * c);
        let slope = [(a * x + b * y) + c * z, (b * x + d * y) + e * z, (c * x + e * y) + f * z];
        let [u, v, w] = slope.map(|slope| slope * over_all);
        let middle = over + ((u * x + v * y) + w * z);
        for (beside, share) in self.beside.iter().zip(&mut self.shares) {
            let [x, y, z] = beside.to;
            *share *= middle - ((u * x + v * y) + w * z);
        }
    }
}
