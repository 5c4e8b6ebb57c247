//! What corners are worth beside their positions: values that a removal's price takes in, as Garland and Heckbert (1998) and Hoppe (1999)
//! do, and normals that new triangles must not turn away from.
//!
//! A vertex removed had a value, or one for each part of its star, where the new triangles have another one at the point nearest to it:
//! area times squared difference is what is lost. What parts at a vertex of the link, and not along the edge that is left, is lost, too.

use super::polygon::MAX_SIDES;
use super::star::Star;
use crate::error::{Error, Result};
use crate::mesh::{Corner, CornerTable, Triangle, Vertex};
use crate::refine::{Labels, Ring, Site};

/// Numbers at the corners of a mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Values {
    /// For each triangle slot and place the row of numbers of the corner; the fourth has no meaning. Empty where there are no numbers.
    pub corners: Vec<[u32; 4]>,
    /// Numbers a row.
    pub width: usize,
    /// The rows. Each number is a length, in sides of the lattice's cube: a difference of it counts as much as a position so far off the
    /// surface. NaN where there is none: it has no price.
    pub rows: Vec<f32>,
    /// So many numbers from the first on are of attributes whose charts are kept, and of no account where these are given up.
    pub of_charts: usize,
    /// Where in a row the three numbers of a normal begin, of any length.
    pub normals: Vec<usize>,
}

/// The values of a mesh that loses its vertices.
#[derive(Debug)]
pub struct Corners {
    labels: Labels,
    values: Values,
    /// The star read last, and the areas of its triangles.
    ring: Ring,
    areas: Vec<f32>,
}

/// The rows round a vertex.
#[derive(Clone, Debug)]
pub struct Around {
    /// Of each triangle, counter-clockwise: at the vertex, at the next one of the link, and at the one before.
    rows: [[u32; 3]; MAX_SIDES],
    /// The areas of the triangles, in squared mean edges.
    areas: [f32; MAX_SIDES],
    count: usize,
    /// Whether all corners at a vertex, of the star's, have one row.
    is_whole: bool,
}

impl Corners {
    /// Those of a mesh; `None` where there are none.
    ///
    /// # Errors
    /// [`Error::Parameter`] where they are not of this table.
    pub fn new(table: &CornerTable, mut values: Values) -> Result<Option<Self>> {
        if values.corners.is_empty() || values.width == 0 {
            return Ok(None);
        }
        let count = values.rows.len() / values.width;
        let is_row = |c: Corner| {
            values.corners.get(c.triangle().index()).is_some_and(|rows| (rows[c.place()] as usize) < count)
        };
        let fit = values.corners.len() == table.slots()
            && table.triangles().flat_map(|t| t.corners()).all(is_row)
            && values.of_charts <= values.width
            && values.normals.iter().all(|&at| at + 3 <= values.width);
        if !fit {
            return Err(Error::Parameter("values that are not of this mesh".to_owned()));
        }
        let labels = Labels::new(std::mem::take(&mut values.corners));
        Ok(Some(Self { labels, values, ring: Ring::default(), areas: Vec::new() }))
    }

    /// Charts are given up: what belongs to them has no price any more.
    pub fn drop_charts(&mut self) {
        let Values { width, rows, of_charts, normals, .. } = &mut self.values;
        rows.chunks_exact_mut(*width).for_each(|row| row[..*of_charts].fill(0.0));
        normals.retain(|&at| at >= *of_charts);
    }

    /// The triangles that are left, in order, are now numbered as in this list.
    pub fn compact(&mut self, there: &[Triangle]) {
        self.labels.compact(there);
    }

    /// The rows round `v`, whose star this is.
    pub fn around(&self, table: &CornerTable, v: Vertex, star: &Star) -> Around {
        let mut around = Around {
            rows: [[0; 3]; MAX_SIDES],
            areas: [0.0; MAX_SIDES],
            count: star.normals().len(),
            is_whole: true,
        };
        let sides = star.ring().len();
        for (i, c) in table.fan(v).enumerate().take(MAX_SIDES) {
            around.rows[i] = [c, c.next(), c.prev()].map(|c| self.labels.of(c));
            let next = if i + 1 < sides { i + 1 } else { 0 };
            around.areas[i] = 0.5 * star.point(i).cross(star.point(next)).length();
            around.is_whole &= around.rows[i][0] == around.rows[0][0];
            around.is_whole &= i == 0 || around.rows[i - 1][2] == around.rows[i][1];
        }
        around.is_whole &= star.boundary || around.rows[around.count - 1][2] == around.rows[0][1];
        around
    }

    /// Reads the star of a vertex that is about to go, `star`, and was inserted at `site`.
    pub fn read(&mut self, table: &CornerTable, v: Vertex, site: Site, star: &Star) {
        self.labels.ring(table, v, site, &mut self.ring);
        let around = self.around(table, v, star);
        let first = self.ring.corners.first().copied().unwrap_or(Corner::NONE);
        let offset = table.fan(v).position(|c| c == first).unwrap_or(0);
        self.areas.clear();
        self.areas.extend((0..around.count).map(|i| around.areas[(i + offset) % around.count]));
    }

    /// It has gone.
    pub fn settle(&mut self, table: &CornerTable, site: Site) {
        let Self { labels, ring, areas, .. } = self;
        labels.settle(table, ring, site, |before, behind| areas[behind] > areas[before]);
    }

    /// What of the values is lost in all where `triangles` take the place of a star and `edge`, two places on the link, is left of it: area
    /// times squared difference, in the units of the cube.
    pub fn price(
        &self,
        star: &Star,
        around: &Around,
        triangles: impl Iterator<Item = [usize; 3]> + Clone,
        edge: Option<(usize, usize)>,
    ) -> f64 {
        let unit = star.mean_edge * star.mean_edge;
        if around.is_whole {
            let row = around.rows[0][0];
            let rows = |i: usize| around.rows[i.min(around.count - 1)][usize::from(i >= around.count) + 1];
            let foot = foot(star, triangles);
            return unit * f64::from(star.area) * self.apart(row, foot.map(|(i, weight)| (rows(i), weight)));
        }
        let split = Split::new(star, edge);
        let mut sum = 0.0;
        for side in split.sides() {
            let of_side = triangles.clone().filter(|t| split.has(side, *t));
            let foot = foot(star, of_side).map(|(i, weight)| (around.row(split, side, i), weight));
            // Neighbouring triangles mostly have one row.
            let mut last = None;
            for i in (0..around.count).filter(|&i| split.side(i) == side) {
                let row = around.rows[i][0];
                let (_, apart) = match last {
                    Some((known, apart)) if known == row => (known, apart),
                    _ => (row, self.apart(row, foot)),
                };
                last = Some((row, apart));
                sum += f64::from(around.areas[i]) * apart;
            }
        }
        // What parts at a vertex of the link and is left on one of both sides only.
        for i in (0..star.ring().len()).filter(|&i| split.is_inner(star, i)) {
            let [x, y] = around.both(i);
            if x != y {
                let behind = i % around.count;
                let before = (i + around.count - 1) % around.count;
                let area = around.areas[behind].min(around.areas[before]);
                sum += f64::from(area) * self.apart(x, [(y, 1.0), (y, 0.0), (y, 0.0)]);
            }
        }
        unit * sum
    }

    /// Whether a triangle of those that take the place of a star would have a corner whose normal points away from it, and no triangle of
    /// the star has.
    pub fn turns_over(
        &self,
        star: &Star,
        around: &Around,
        triangles: impl Iterator<Item = [usize; 3]>,
        edge: Option<(usize, usize)>,
    ) -> bool {
        if self.values.normals.is_empty() {
            return false;
        }
        let points_away = |normal: glam::Vec3, row: u32| {
            let row = self.row(row);
            self.values.normals.iter().any(|&at| normal.dot(glam::Vec3::from_slice(&row[at..at + 3])) < 0.0)
        };
        let split = Split::new(star, edge);
        let mut turned = false;
        for t in triangles {
            let [a, b, c] = t.map(|i| star.point(i));
            let normal = (b - a).cross(c - a);
            let side = split.side_of(t);
            turned |= t.into_iter().any(|i| points_away(normal, around.row(split, side, i)));
        }
        let were = |i: usize| around.rows[i].iter().any(|&row| points_away(star.normals()[i], row));
        turned && !(0..around.count).any(were)
    }

    #[inline]
    fn row(&self, row: u32) -> &[f32] {
        let width = self.values.width;
        &self.values.rows[row as usize * width..][..width]
    }

    /// The squared difference of a row and of what lies between three others.
    fn apart(&self, row: u32, foot: [(u32, f32); 3]) -> f64 {
        let [(a, s), (b, t), (c, u)] = foot;
        if [a, b, c] == [row; 3] {
            return 0.0;
        }
        let (row, a, b, c) = (self.row(row), self.row(a), self.row(b), self.row(c));
        let mut sum = 0.0f32;
        for k in 0..self.values.width {
            let off = row[k] - (s * a[k] + t * b[k] + u * c[k]);
            if off.is_finite() {
                sum += off * off;
            }
        }
        f64::from(sum)
    }
}

impl Around {
    /// Whether all corners at each vertex have one row.
    pub fn is_whole(&self) -> bool {
        self.is_whole
    }

    /// The rows of the two corners at a vertex of the link: of the triangle before it, and of the one behind.
    fn both(&self, i: usize) -> [u32; 2] {
        let before = (i + self.count - 1) % self.count;
        [self.rows[before][2], self.rows[i % self.count][1]]
    }

    /// The row that the corners at a vertex of the link have on a side of the edge that is left, as [`Labels::settle`] has it.
    fn row(&self, split: Split, side: usize, i: usize) -> u32 {
        let [x, y] = self.both(i);
        let takes_second = match split {
            Split::Open(_) if i == 0 => true,
            Split::Open(last) if i == last => false,
            Split::Edge(a, _) if i == a => side == 0,
            Split::Edge(_, b) if i == b => side == 1,
            _ => self.areas[i % self.count] > self.areas[(i + self.count - 1) % self.count],
        };
        if takes_second { y } else { x }
    }
}

/// How an edge parts a star.
#[derive(Clone, Copy, Debug)]
enum Split {
    /// Not at all: a face takes its place.
    None,
    /// A star at the boundary, which has one side; the last place on its link.
    Open(usize),
    /// Side 0 goes from the first place to the second, side 1 on from there.
    Edge(usize, usize),
}

impl Split {
    fn new(star: &Star, edge: Option<(usize, usize)>) -> Self {
        match edge {
            _ if star.boundary => Self::Open(star.ring().len() - 1),
            Some((a, b)) => Self::Edge(a.min(b), a.max(b)),
            None => Self::None,
        }
    }

    fn sides(self) -> std::ops::Range<usize> {
        if matches!(self, Self::Edge(..)) { 0..2 } else { 0..1 }
    }

    /// The side that a triangle of the star is on.
    fn side(self, i: usize) -> usize {
        match self {
            Self::Edge(a, b) => usize::from(i < a || b <= i),
            _ => 0,
        }
    }

    /// The side that a new triangle is on.
    fn side_of(self, triangle: [usize; 3]) -> usize {
        usize::from(!self.has(0, triangle))
    }

    fn has(self, side: usize, triangle: [usize; 3]) -> bool {
        match self {
            Self::Edge(a, b) => (side == 0) == triangle.iter().all(|i| (a..=b).contains(i)),
            _ => true,
        }
    }

    /// Whether all new corners at a vertex of the link are on one side.
    fn is_inner(self, star: &Star, i: usize) -> bool {
        match self {
            Self::None => true,
            Self::Open(last) => i > 0 && i < last && star.ring().len() > 2,
            Self::Edge(a, b) => i != a && i != b,
        }
    }
}

/// The point of some triangles of the polygon, or of its only edge, that is nearest to the vertex: three places on the link, and what each
/// of them weighs.
fn foot(star: &Star, triangles: impl Iterator<Item = [usize; 3]> + Clone) -> [(usize, f32); 3] {
    let mut nearest = ([(0, 1.0), (0, 0.0), (0, 0.0)], f32::INFINITY);
    for t in triangles {
        let point = star.foot([t].into_iter());
        let squared = point.length_squared();
        if squared < nearest.1 {
            nearest = ([0, 1, 2].map(|k| (t[k], 0.0)), squared);
            let corners = t.map(|i| star.point(i));
            for (entry, weight) in nearest.0.iter_mut().zip(weights(corners, point)) {
                entry.1 = weight;
            }
        }
    }
    nearest.0
}

/// What the corners of a triangle weigh at a point of it.
fn weights([a, b, c]: [glam::Vec3; 3], p: glam::Vec3) -> [f32; 3] {
    let normal = (b - a).cross(c - a);
    let squared = normal.length_squared();
    if squared > f32::MIN_POSITIVE {
        let [s, t] = [(b - p).cross(c - p), (c - p).cross(a - p)].map(|part| part.dot(normal) / squared);
        return [s, t, 1.0 - s - t];
    }
    // All in a line: between the ends of the longest side.
    let apart = [b.distance_squared(c), c.distance_squared(a), a.distance_squared(b)];
    let longest = (0..3).max_by(|&i, &j| apart[i].total_cmp(&apart[j])).unwrap_or(0);
    let corners = [a, b, c];
    let [from, to] = [(longest + 1) % 3, (longest + 2) % 3];
    let along = corners[to] - corners[from];
    let t = if apart[longest] > 0.0 { (p - corners[from]).dot(along) / apart[longest] } else { 0.0 };
    let mut weights = [0.0; 3];
    (weights[from], weights[to]) = (1.0 - t, t);
    weights
}
