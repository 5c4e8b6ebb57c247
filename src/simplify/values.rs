//! What corners are worth beside their positions: values that a removal's price takes in, as Garland and Heckbert (1998) and Hoppe (1999)
//! do.
//!
//! A vertex removed had a value, or one for each part of its star, where the new triangles have another one at the point nearest to it:
//! area times squared difference is what is lost. What parts at a vertex of the link, and not along the edge that is left, is lost, too;
//! and so are normals of new triangles that point away from them.

use super::polygon::MAX_SIDES;
use super::star::Star;
use crate::error::{Error, Result};
use crate::mesh::{Corner, CornerTable, Triangle, Vertex};
use crate::refine::labels::{Parting, Slid, Taken};
use crate::refine::{Labels, Ring, Site};
use glam::Vec3;

/// Numbers at the corners of a mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Values {
    /// For each triangle slot and place the row of numbers of the corner; the fourth tells triangles apart that never take each other's
    /// place. Empty where there is nothing to tell.
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
    /// For each row what it is in charts, and in those that are kept at all levels: these meet where corners at one vertex differ. Empty
    /// where none meet.
    pub charts: Vec<[u32; 2]>,
}

/// The values of a mesh that loses its vertices.
#[derive(Debug)]
pub struct Corners {
    labels: Labels,
    values: Values,
    /// Which of the charts are kept.
    kept: usize,
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
    /// What tells the triangles apart.
    kinds: [u32; MAX_SIDES],
    /// Whether all corners at a vertex, of the star's, have one row.
    is_whole: bool,
    /// The sum of the triangles' normals, twice as long as they are large.
    up: Vec3,
}

impl Corners {
    /// Those of a mesh; `None` where there are none.
    ///
    /// # Errors
    /// [`Error::Parameter`] where they are not of this table.
    pub fn new(table: &CornerTable, mut values: Values) -> Result<Option<Self>> {
        if values.corners.is_empty() || (values.width == 0 && values.charts.is_empty()) {
            return Ok(None);
        }
        let count = values.rows.len().checked_div(values.width).unwrap_or(values.charts.len());
        let is_row = |c: Corner| {
            values.corners.get(c.triangle().index()).is_some_and(|rows| (rows[c.place()] as usize) < count)
        };
        let fit = values.corners.len() == table.slots()
            && table.triangles().flat_map(|t| t.corners()).all(is_row)
            && values.of_charts <= values.width
            && (values.charts.is_empty() || values.charts.len() == count)
            && values.normals.iter().all(|&at| at + 3 <= values.width);
        if !fit {
            return Err(Error::Parameter("values that are not of this mesh".to_owned()));
        }
        let labels = Labels::new(std::mem::take(&mut values.corners));
        Ok(Some(Self { labels, values, kept: 0, ring: Ring::default(), areas: Vec::new() }))
    }

    /// Whether not all corners are worth the same.
    pub fn vary(&self) -> bool {
        self.values.rows.len() > self.values.width
    }

    /// Whether there are charts that meet.
    pub fn have_charts(&self) -> bool {
        !self.values.charts.is_empty()
    }

    /// Charts are given up but for those that are kept at all levels: what belongs to them has no price any more.
    pub fn drop_charts(&mut self) {
        self.kept = 1;
        let Values { width, rows, of_charts, normals, .. } = &mut self.values;
        rows.chunks_exact_mut((*width).max(1)).for_each(|row| row[..*of_charts].fill(0.0));
        normals.retain(|&at| at >= *of_charts);
    }

    /// The triangles that are left, in order, are now numbered as in this list.
    pub fn compact(&mut self, there: &[Triangle]) {
        self.labels.compact(there);
    }

    /// Whether charts meet at a vertex in another way than along a curve through it, those but that are given up; and so of those that are
    /// kept at all levels.
    pub fn are_corners(&self, table: &CornerTable, v: Vertex) -> [bool; 2] {
        if !self.have_charts() {
            return [false; 2];
        }
        let is_boundary = table.is_boundary(v);
        [self.kept, 1].map(|kept| {
            let is_border = |c: &Corner| {
                let o = table.opposite(c.prev());
                let ends = [(*c, o.prev()), (c.next(), o.next())];
                let of = |c: Corner| self.values.charts[self.labels.of(c) as usize][kept];
                o.is_some() && ends.iter().any(|&(x, y)| of(x) != of(y))
            };
            let borders = table.fan(v).filter(is_border).count();
            borders > 0 && (is_boundary || borders != 2)
        })
    }

    /// The places on the link of a star that borders of charts lead to, a bit each.
    pub fn borders(&self, star: &Star, around: &Around) -> u64 {
        if around.is_whole || !self.have_charts() {
            return 0;
        }
        let of = |row: u32| self.values.charts[row as usize][self.kept];
        let is_border = |&i: &usize| {
            let (x, y) = (&around.rows[(i + around.count - 1) % around.count], &around.rows[i]);
            of(x[0]) != of(y[0]) || of(x[2]) != of(y[1])
        };
        (usize::from(star.boundary)..around.count).filter(is_border).map(|i| 1 << i).sum()
    }

    /// Whether the only triangle of a star may go, the one behind it staying.
    pub fn may_shed(&self, table: &CornerTable, ear: Corner) -> bool {
        let behind = table.opposite(ear);
        let kind = |c: Corner| self.labels.of_triangle(c.triangle());
        behind.is_none() || kind(ear) == kind(behind)
    }

    /// The rows round `v`, whose star this is.
    pub fn around(&self, table: &CornerTable, v: Vertex, star: &Star) -> Around {
        let mut around = Around {
            rows: [[0; 3]; MAX_SIDES],
            areas: [0.0; MAX_SIDES],
            count: star.normals().len(),
            kinds: [0; MAX_SIDES],
            is_whole: true,
            up: Vec3::ZERO,
        };
        let sides = star.ring().len();
        for (i, c) in table.fan(v).enumerate().take(MAX_SIDES) {
            around.rows[i] = [c, c.next(), c.prev()].map(|c| self.labels.of(c));
            around.kinds[i] = self.labels.of_triangle(c.triangle());
            let next = if i + 1 < sides { i + 1 } else { 0 };
            let twice = star.point(i).cross(star.point(next));
            around.areas[i] = 0.5 * twice.length();
            around.up += twice;
            around.is_whole &= around.rows[i][0] == around.rows[0][0];
            around.is_whole &= i == 0 || around.rows[i - 1][2] == around.rows[i][1];
        }
        around.is_whole &= star.boundary || around.rows[around.count - 1][2] == around.rows[0][1];
        around
    }

    /// Reads the star of a vertex that is about to go, `star`, and was inserted at `site`. Told is whether it goes onto another one.
    pub fn read(&mut self, table: &CornerTable, v: Vertex, site: Site, star: &Star) -> Option<Slid> {
        self.labels.ring(table, v, site, &mut self.ring);
        let around = self.around(table, v, star);
        let first = self.ring.corners.first().copied().unwrap_or(Corner::NONE);
        let offset = table.fan(v).position(|c| c == first).unwrap_or(0);
        self.areas.clear();
        self.areas.extend((0..around.count).map(|i| around.areas[(i + offset) % around.count]));
        star.slide.map(|parting| Slid {
            vertex: v,
            onto: star.ring()[parting.target()],
            borders: parting.seen_from(offset).borders(),
        })
    }

    /// It has gone.
    pub fn settle(&mut self, table: &CornerTable, site: Site, slid: Option<&Slid>) {
        let Self { labels, ring, areas, .. } = self;
        let parting = slid.map_or_else(|| ring.parting(site), |slid| ring.parting_of(slid));
        labels.settle(table, ring, site, parting, |before, behind| areas[behind] > areas[before]);
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
        let split = star.parting(edge);
        let turned = self.turned(star, around, triangles.clone(), &split);
        if around.is_whole {
            let row = around.rows[0][0];
            let rows = |i: usize| around.rows[i.min(around.count - 1)][usize::from(i >= around.count) + 1];
            let foot = foot(star, triangles);
            let apart = self.apart(row, foot.map(|(i, weight)| (rows(i), weight)));
            return unit * (f64::from(star.area) * apart + turned);
        }
        let mut sum = turned;
        for side in 0..split.count() {
            let of_side = triangles.clone().filter(|t| split.part_of(*t) == side);
            if of_side.clone().next().is_none() {
                sum += self.lost(star, around, &split, side);
                continue;
            }
            let foot = foot(star, of_side).map(|(i, weight)| (around.row(&split, side, i), weight));
            // Neighbouring triangles mostly have one row.
            let mut last = None;
            for i in split.triangles_of(side) {
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
        for i in (0..star.ring().len()).filter(|&i| split.is_inner(i)) {
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

    /// What is lost with the only triangle of a part: what is seen there now has come as far as the vertex has gone, or to the edge at which
    /// the triangle lay.
    fn lost(&self, star: &Star, around: &Around, split: &Parting, part: usize) -> f64 {
        let Some(i) = split.triangles_of(part).next() else { return 0.0 };
        let ends = [i, (i + 1) % star.ring().len()];
        let off = if split.count() == 2 && !star.boundary {
            star.foot([[ends[0], ends[0], ends[1]]].into_iter())
        } else {
            star.point(split.target())
        };
        let far = f64::from(off.length_squared()) * star.mean_edge * star.mean_edge;
        let beside = around.rows[split.triangles_of(split.carried(i)).next().unwrap_or(i)][0];
        let (own, beside) = (self.row(around.rows[i][0]), self.row(beside));
        let of_charts = self.values.of_charts;
        let apart =
            |(x, y): (&f32, &f32)| if (x - y).is_finite() { f64::from((x - y) * (x - y)) } else { 0.0 };
        let soft: f64 = own[of_charts..].iter().zip(&beside[of_charts..]).map(apart).sum();
        f64::from(around.areas[i]) * (LOST * far + soft)
    }

    /// What of the values is lost where an edge from one place on the link to another takes the place of the spokes that it crosses: half the
    /// area of each triangle beside them times squared difference at the crossing, in distortions of the star.
    ///
    /// Where triangles meet in a plane, the values before and after differ at the vertex and at these crossings, and between them linearly.
    pub fn along(&self, star: &Star, around: &Around, (i, j): (usize, usize)) -> f32 {
        let (sides, count) = (star.ring().len(), around.count);
        let (from, way) = (star.point(i), star.point(j) - star.point(i));
        // On which side of the edge the vertex lies.
        let off = from.cross(way).dot(around.up);
        let (a, b, spokes) = if off > 0.0 {
            (around.behind(i), around.before(star, j), i + 1..j)
        } else {
            (around.before(star, i), around.behind(j), j + 1..i + sides)
        };
        let of_edge = [a, b].map(|row| self.row(row));
        let mut sum = 0.0;
        for k in spokes.map(|k| k % sides) {
            let across = star.point(k).cross(way).dot(around.up);
            let t = off / across;
            if !(0.0..=1.0).contains(&t) {
                continue;
            }
            let s = (from.cross(star.point(k)).dot(around.up) / across).clamp(0.0, 1.0);
            // The triangles before and behind the spoke, with the places in them of the corner at its end.
            let before = if k > 0 { Some(k - 1) } else { (!star.boundary).then(|| count - 1) };
            for (triangle, end) in [(before, 2), ((k < count).then_some(k), 1)] {
                let Some(triangle) = triangle else { continue };
                let of_spoke = [0, end].map(|place| around.rows[triangle][place]);
                if of_spoke == [a, a] && a == b {
                    continue;
                }
                let ([v, w], [a, b]) = (of_spoke.map(|row| self.row(row)), of_edge);
                let of_numbers = (0..self.values.width).map(|n| {
                    let off = (1.0 - t) * v[n] + t * w[n] - (1.0 - s) * a[n] - s * b[n];
                    if off.is_finite() { off * off } else { 0.0 }
                });
                sum += 0.5 * around.areas[triangle] * of_numbers.sum::<f32>();
            }
        }
        sum / (star.mean_edge * star.mean_edge) as f32
    }

    /// Whether normals turn by more than [`CREASE`] at a vertex, or from it to a neighbour.
    pub fn is_creased(&self, table: &CornerTable, v: Vertex) -> bool {
        self.values.normals.iter().any(|&at| {
            let normal = |c: Corner| Vec3::from_slice(&self.row(self.labels.of(c))[at..at + 3]);
            let Some(own) = table.fan(v).next().map(normal) else { return false };
            let mut others = table.fan(v).flat_map(|c| [c, c.next(), c.prev()]).map(normal);
            others.any(|other| own.dot(other) < CREASE * own.length() * other.length())
        })
    }

    /// What is lost by normals that point away from a new triangle at its corners, if none does in the star: they are as far off there as
    /// they can be.
    fn turned(
        &self,
        star: &Star,
        around: &Around,
        triangles: impl Iterator<Item = [usize; 3]>,
        split: &Parting,
    ) -> f64 {
        if self.values.normals.is_empty() {
            return 0.0;
        }
        // The squared difference from the opposite of a normal, of the sum of all.
        let off = |normal: Vec3, row: u32| -> f32 {
            let row = self.row(row);
            let normals = self.values.normals.iter().map(|&at| Vec3::from_slice(&row[at..at + 3]));
            normals.filter(|n| normal.dot(*n) < 0.0).map(|n| 4.0 * n.length_squared()).sum()
        };
        let mut sum = 0.0;
        for t in triangles {
            let [a, b, c] = t.map(|i| star.point(i));
            let (normal, side) = ((b - a).cross(c - a), split.part_of(t));
            let corners = t.into_iter().map(|i| off(normal, around.row(split, side, i))).sum::<f32>();
            sum += f64::from(normal.length() * corners) / 6.0;
        }
        let were = |i: usize| around.rows[i].iter().any(|&row| off(star.normals()[i], row) > 0.0);
        if sum > 0.0 && (0..around.count).any(were) { 0.0 } else { sum }
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

    /// The row at a vertex of the link in the triangle behind it, or in the last one.
    fn behind(&self, i: usize) -> u32 {
        if i < self.count { self.rows[i][1] } else { self.rows[self.count - 1][2] }
    }

    /// The row at a vertex of the link in the triangle before it, or in the first one.
    fn before(&self, star: &Star, i: usize) -> u32 {
        match i {
            0 if star.boundary => self.rows[0][1],
            0 => self.rows[self.count - 1][2],
            _ => self.rows[i - 1][2],
        }
    }

    /// The row that the corners at a vertex of the link have in a part, as [`Labels::settle`] has it.
    fn row(&self, split: &Parting, part: usize, i: usize) -> u32 {
        let larger = |x: usize, y: usize| self.areas[y] > self.areas[x];
        match split.taken(part, i) {
            Taken::Before(x) => self.rows[x][2],
            Taken::Behind(y) => self.rows[y][1],
            Taken::Either(x, y) if larger(x, y) => self.rows[y][1],
            Taken::Either(x, _) => self.rows[x][2],
            Taken::Own => self.rows[split.largest(part, larger)][0],
        }
    }

    /// Whether each triangle may be one of the part that takes its place.
    pub fn fits(&self, split: &Parting) -> bool {
        let of_part = |part: usize| split.triangles_of(part).next().map(|i| self.kinds[i]);
        (0..self.count).all(|i| !split.is_lost(i) || of_part(split.carried(i)) == Some(self.kinds[i]))
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
fn weights([a, b, c]: [Vec3; 3], p: Vec3) -> [f32; 3] {
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

/// What the loss of a chart's last triangle at a vertex weighs beside texture that slips as far.
const LOST: f64 = 1.0;

/// The cosine of the angle, 30 degrees, from which on normals stand for an edge of the surface and not for a bend that few triangles
/// follow: a circle of them is of more than twelve sides.
const CREASE: f32 = 0.866;

#[cfg(test)]
mod tests {
    use super::super::removal::vertices;
    use super::super::{Features, Options, simplify};
    use super::*;
    use crate::mesh::random::SplitMix64;
    use crate::mesh::{IndexedMesh, Lattice, lattice, shapes};
    use crate::refine::Operation;
    use bitvec::vec::BitVec;
    use glam::DVec3;

    fn table(mesh: &IndexedMesh) -> CornerTable {
        CornerTable::from_triangles(mesh.positions.len(), &mesh.triangles).unwrap()
    }

    /// One number a corner.
    fn values(table: &CornerTable, of: impl Fn(Corner) -> f32) -> Values {
        let mut values = Values { width: 1, corners: vec![[0; 4]; table.slots()], ..Values::default() };
        for c in table.triangles().flat_map(|t| t.corners()) {
            let known = values.rows.iter().position(|&row| row == of(c));
            let row = known.unwrap_or_else(|| {
                values.rows.push(of(c));
                values.rows.len() - 1
            });
            values.corners[c.triangle().index()][c.place()] = row as u32;
        }
        values
    }

    fn star(table: &CornerTable, v: Vertex, mesh: &IndexedMesh) -> Star {
        let at = |v: Vertex| DVec3::from_array(mesh.positions[v.index()]);
        Star::new(table.link(v).into_iter(), table.is_boundary(v), at(v), at).unwrap()
    }

    fn run(mesh: &IndexedMesh, values: Values, vertices: usize) -> super::super::Simplified {
        let (min, max) = lattice::bounds(mesh.positions.iter().copied()).unwrap();
        let options = Options { base_vertices: Some(vertices), ..Options::default() };
        let locked = BitVec::repeat(false, mesh.positions.len());
        let features = Features { values, ..Features::default() };
        let lattice = Lattice::over(min, max, 14);
        simplify(table(mesh), &mesh.positions, locked, features, &lattice, &options, &mut |_, _| true)
            .unwrap()
    }

    #[test]
    fn what_is_the_same_everywhere_changes_nothing() {
        for mesh in [
            shapes::torus(24, 36),
            shapes::bumpy_sphere(4, 3),
            shapes::disc_with_ears(),
            shapes::grid(20, 30),
        ] {
            let free = run(&mesh, Values::default(), 30);
            let mut constant = values(&table(&mesh), |_| 0.7);
            constant.of_charts = 1;
            let priced = run(&mesh, constant, 30);
            assert_eq!(free.history, priced.history);
            // Numbers that nobody has have no price.
            let none = values(&table(&mesh), |_| 0.0);
            let none = Values { rows: vec![f32::NAN; none.rows.len()], ..none };
            assert_eq!(free.history, run(&mesh, none, 30).history);
        }
    }

    /// A flat sheet may lose everything but for a ridge of its values, which the vertices that are left have to stand along.
    #[test]
    fn where_values_bend_vertices_stay() {
        let mut mesh = shapes::grid(30, 30);
        mesh.positions.iter_mut().for_each(|p| p[2] = 0.0);
        let table = table(&mesh);
        let ridge = |p: [f64; 3]| -> f64 { 1.0 - 0.1 * (p[0] + p[1] - 30.0).abs().min(5.0) };
        let of = |c: Corner| ridge(mesh.positions[table.vertex(c).index()]) as f32;
        let off = |done: &super::super::Simplified| {
            let on = |v: &Vertex| {
                let [x, y, _] = mesh.positions[v.index()];
                (x + y - 30.0).abs() <= 6.0
            };
            vertices(&done.base).filter(on).count() as f64 / vertices(&done.base).count() as f64
        };
        let [free, priced] =
            [Values::default(), values(&table, of)].map(|values| off(&run(&mesh, values, 80)));
        assert!(priced > 0.6 && free < 0.5, "{priced} of the vertices, {free} without values");
    }

    /// A flat regular hexagon, its middle the last vertex, and the fan from the first vertex that may take its place.
    fn hexagon() -> (IndexedMesh, Star) {
        let corner = |k: u32| {
            let turn = std::f64::consts::TAU * f64::from(k) / 6.0;
            [turn.cos(), turn.sin(), 0.0]
        };
        let mut positions: Vec<_> = (0..6).map(corner).collect();
        positions.push([0.0; 3]);
        let mesh = IndexedMesh::new(positions, (0..6).map(|k| [6, k, (k + 1) % 6]).collect());
        let star = star(&table(&mesh), Vertex(6), &mesh);
        assert_eq!(star.ring(), [0, 1, 2, 3, 4, 5].map(Vertex));
        (mesh, star)
    }

    const FAN: [[usize; 3]; 4] = [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]];

    #[test]
    fn a_price_is_area_times_squared_difference() {
        let (mesh, star) = hexagon();
        let table = table(&mesh);
        let price = |of: &dyn Fn(Corner) -> f32, edge| {
            let corners = Corners::new(&table, values(&table, of)).unwrap().unwrap();
            let around = corners.around(&table, Vertex(6), &star);
            corners.price(&star, &around, FAN.into_iter(), Some(edge))
        };
        let area = 1.5 * 3.0f64.sqrt();
        let close =
            |price: f64, expected: f64| assert!((price - expected).abs() < 1e-5, "{price} for {expected}");
        let place = |c: Corner| mesh.positions[table.vertex(c).index()];
        let plane = |c: Corner| (place(c)[0] + 2.0 * place(c)[1]) as f32;
        let peak = |c: Corner| plane(c) + if table.vertex(c) == Vertex(6) { 0.5 } else { 0.0 };
        // A step along the line from the first vertex to the fourth, the fifth of the triangles is between the fourth and the fifth vertex.
        let step = |c: Corner| if c.triangle().index() < 3 { plane(c) } else { 7.0 };
        // One that comes to an end inside, along the edge to the third vertex only.
        let end = |c: Corner| f32::from(u8::from(c == Corner(4 * 2 + 1)));
        for edge in [(0, 2), (0, 3), (0, 4)] {
            close(price(&plane, edge), 0.0);
            close(price(&peak, edge), 0.25 * area);
        }
        close(price(&step, (0, 3)), 0.0);
        assert!(price(&step, (0, 2)) > 1.0 && price(&step, (0, 4)) > 1.0);
        // A sixth of the star has another value at one of its corners, and not the edge that is left: as if it had it everywhere.
        close(price(&end, (0, 3)), area / 6.0);
        close(price(&end, (0, 2)), 0.0);
    }

    /// Normals of triangles that are turned over are as far off as they can be; where they were before, too, they tell nothing.
    /// Only the middle is worth something: an edge across it crosses the middle itself and so the spokes of either side, with half of the
    /// triangles beside each of them; one between the next neighbours but one crosses one spoke half way.
    #[test]
    fn what_an_edge_crosses_is_lost() {
        let (mesh, star) = hexagon();
        let table = table(&mesh);
        let lost = |of: &dyn Fn(Corner) -> f32, edge| {
            let corners = Corners::new(&table, values(&table, of)).unwrap().unwrap();
            corners.along(&star, &corners.around(&table, Vertex(6), &star), edge)
        };
        let peak = |c: Corner| if table.vertex(c) == Vertex(6) { 2.0 } else { 0.0 };
        let triangle = 3f32.sqrt() / 4.0;
        for (edge, expected) in [((0, 3), 2.0 * triangle * 4.0), ((0, 2), triangle), ((1, 5), triangle)] {
            let lost = lost(&peak, edge);
            assert!((lost - expected).abs() < 1e-4, "{edge:?}: {lost} instead of {expected}");
        }
        let linear = |c: Corner| {
            let [x, y, _] = mesh.positions[table.vertex(c).index()];
            (3.0 * x - y) as f32
        };
        for edge in [(0, 2), (0, 3), (1, 5), (2, 4)] {
            assert!(lost(&linear, edge).abs() < 1e-4);
        }
        // Twice as much on one side of a break along the edge is no loss; across it, at the middle, half of what the far end has too much is.
        let broken = |c: Corner| {
            let side = if [3, 4, 5].contains(&c.triangle().index()) { 2.0 } else { 1.0 };
            linear(c) * side
        };
        assert!(lost(&broken, (0, 3)).abs() < 1e-4);
        let too_much = 0.5 * (1.5 - 0.75f32.sqrt());
        assert!((lost(&broken, (1, 4)) - 2.0 * triangle * too_much * too_much).abs() < 1e-4);
    }

    #[test]
    fn a_crease_is_where_normals_turn() {
        let (mesh, _) = hexagon();
        let table = table(&mesh);
        for (degrees, expected) in [(0.0, false), (25.0, false), (35.0, true), (180.0, true)] {
            let angle = f32::to_radians(degrees);
            let mut values = values(&table, |c| if table.vertex(c) == Vertex(2) { 1.0 } else { 0.0 });
            let first = values.rows[0];
            let mut rows = [[0.0, 0.0, 0.5], [0.5 * angle.sin(), 0.0, 0.5 * angle.cos()]];
            if first == 1.0 {
                rows.reverse();
            }
            (values.width, values.normals, values.rows) = (3, vec![0], rows.concat());
            let corners = Corners::new(&table, values).unwrap().unwrap();
            assert_eq!(corners.is_creased(&table, Vertex(6)), expected, "{degrees}");
        }
    }

    #[test]
    fn normals_that_point_away_are_lost() {
        let (mesh, star) = hexagon();
        let table = table(&mesh);
        let price = |z: f32, triangles: [[usize; 3]; 4]| {
            let corners = vec![[0; 4]; table.slots()];
            let values = Values {
                corners,
                width: 3,
                rows: vec![0.0, 0.0, z],
                of_charts: 0,
                normals: vec![0],
                charts: Vec::new(),
            };
            let corners = Corners::new(&table, values).unwrap().unwrap();
            let around = corners.around(&table, Vertex(6), &star);
            corners.price(&star, &around, triangles.into_iter(), Some((0, 3)))
        };
        let over = FAN.map(|[i, k, j]| [j, k, i]);
        assert_eq!([price(0.1, FAN), price(-0.1, over), price(-0.1, FAN)], [0.0; 3]);
        let expected = 1.5 * 3.0f64.sqrt() * 0.2 * 0.2;
        assert!((price(0.1, over) - expected).abs() < 1e-6, "{} for {expected}", price(0.1, over));
    }

    /// What a price takes a new corner's row to be is what it is afterwards.
    #[test]
    fn rows_are_those_that_are_priced() {
        let mut seen = 0;
        for (seed, mesh) in
            (0..).zip([shapes::torus(8, 6), shapes::sphere(2), shapes::grid(6, 5), shapes::annulus(12)])
        {
            let mut random = SplitMix64::new(seed);
            let table = table(&mesh);
            let count = table.slots();
            let of: Vec<f32> = (0..4 * count).map(|_| random.below(3) as f32).collect();
            let corners = Corners::new(&table, values(&table, |c| of[c.index()])).unwrap().unwrap();
            for v in vertices(&table) {
                let star = star(&table, v, &mesh);
                if star.ring().len() < 3 {
                    continue;
                }
                let Some(best) = star.solve(0.1, |_, _| 0.0).shape.triangulation() else { continue };
                let sides = star.ring().len();
                let edges: Vec<_> =
                    if star.boundary { vec![(sides - 1, 0)] } else { best.diagonals().collect() };
                for edge in edges {
                    let (site, flips) = best.operation(star.ring(), edge);
                    let operation =
                        Operation { vertex: v, site, first_flip: 0, flip_count: flips.len() as u32 };
                    let mut coarse = table.clone();
                    let mut after = Corners {
                        labels: corners.labels.clone(),
                        values: corners.values.clone(),
                        kept: 0,
                        ring: Ring::default(),
                        areas: Vec::new(),
                    };
                    after.read(&table, v, site, &star);
                    if operation.undo(&mut coarse, &flips).is_err() {
                        continue;
                    }
                    after.settle(&coarse, site, None);
                    let around = corners.around(&table, v, &star);
                    let split = star.parting(Some(edge));
                    for t in best.triangles.iter() {
                        let c = coarse.find_directed_edge(star.ring()[t[0]], star.ring()[t[1]]);
                        let places = [(t[0], c.next()), (t[1], c.prev()), (t[2], c)];
                        for (i, c) in places {
                            assert_eq!(coarse.vertex(c), star.ring()[i]);
                            assert_eq!(after.labels.of(c), around.row(&split, split.part_of(t), i));
                            seen += 1;
                        }
                    }
                }
            }
        }
        assert!(seen > 500, "{seen}");
    }

    #[test]
    fn values_are_those_of_the_mesh() {
        let mesh = shapes::torus(5, 4);
        let table = table(&mesh);
        assert!(Corners::new(&table, Values::default()).unwrap().is_none());
        let good = values(&table, |c| c.place() as f32);
        assert!(Corners::new(&table, good.clone()).unwrap().is_some());
        for bad in [
            Values { width: 2, ..good.clone() },
            Values { of_charts: 2, ..good.clone() },
            Values { normals: vec![0], ..good.clone() },
            Values { corners: good.corners[1..].to_vec(), ..good.clone() },
        ] {
            assert!(matches!(Corners::new(&table, bad), Err(Error::Parameter(_))));
        }
    }
}
