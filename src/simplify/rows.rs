//! Levels along the rows of a regular sampling: of four classes, three go, one level after the other; then what is left has classes again.
//!
//! Where the pattern holds nearly everywhere, levels follow it exactly: what goes and what takes its place is then known nearly
//! everywhere too, which costs next to no bits. Elsewhere it is a preference, where the options ask for it.

use super::Regular;
use super::parity::{Classes, NONE};
use super::removal::{Remover, vertices};
use super::seconds::timed;
use super::values::Corners;
use crate::mesh::{CornerTable, Triangle, Vertex};
use bitvec::bitvec;
use bitvec::vec::BitVec;
use glam::Vec3;

/// The classes of the vertices, and how soon each class goes: edges between vertices that go soon are dear.
#[derive(Debug)]
pub struct Pattern {
    /// The class that goes.
    pub class: u8,
    classes: Classes,
    /// By class, 0 for those that stay; the last entry is that of vertices without a class.
    ranks: [u8; 5],
    /// Vertices round which the pattern holds; none where it is but a preference.
    holds: BitVec,
    /// Of each vertex of the last class that goes, the two neighbours that it lay between when the round began, if they were two.
    mates: Vec<[Vertex; 2]>,
    /// What an edge costs for each rank of its two ends where the pattern is a preference, in mean edges.
    preference: f32,
}

impl Pattern {
    /// Of a mesh with these classes, and what corners are worth: rows are not followed over a crease, which would come to lie beside its
    /// vertices.
    fn new(table: &CornerTable, corners: Option<&Corners>, classes: Classes) -> Self {
        let mut holds = holds(table, &classes.of);
        if let Some(corners) = corners {
            for v in vertices(table).filter(|&v| corners.is_creased(table, v)) {
                holds.set(v.index(), false);
            }
        }
        let of_mesh = vertices(table).count();
        if (holds.count_ones() as f64) < NEARLY * of_mesh as f64 {
            holds.fill(false);
        }
        let mut mates = Vec::new();
        if holds.any() {
            mates.resize(table.vertex_slots(), [Vertex::NONE; 2]);
            for v in vertices(table).filter(|v| classes.of[v.index()] == LAST) {
                let mut stay = table.vertices_round(v).filter(|w| classes.of[w.index()] == STAYS);
                if let [Some(a), Some(b), None] = [stay.next(), stay.next(), stay.next()] {
                    mates[v.index()] = [a, b];
                }
            }
        }
        let preference = preference(classes.fit);
        Self { class: 0, classes, ranks: [0; 5], holds, mates, preference }
    }

    /// Whether levels follow the pattern.
    pub fn is_exact(&self) -> bool {
        self.holds.any()
    }

    /// Whether levels follow the pattern at a vertex.
    #[inline]
    pub fn holds(&self, v: Vertex) -> bool {
        self.holds[v.index()]
    }

    /// A vertex's class.
    #[inline]
    pub fn class_of(&self, v: Vertex) -> u8 {
        self.classes.of[v.index()]
    }

    /// What an edge from `a` to `b`, this `way`, costs where it is made in place of `v`, in mean edges.
    #[inline]
    pub fn bias(&self, v: Vertex, [a, b]: [Vertex; 2], way: Vec3) -> f32 {
        let rank = |v: Vertex| f32::from(self.ranks[usize::from(self.class_of(v))]);
        let ranks = rank(a) + rank(b);
        if !self.holds(v) {
            return self.preference * ranks;
        }
        let mut bias = FIRST * ranks;
        if self.class == LAST && ranks == 0.0 {
            // Between four vertices that stay either diagonal would do; but the next round needs triangles as they were, or all the same.
            bias += match self.mates[v.index()] {
                mates if mates[0].is_none() => SECOND * (1.0 - way.normalize_or_zero().dot(ODD).abs()),
                mates if mates == [a, b] || mates == [b, a] => 0.0,
                _ => SECOND,
            };
        }
        bias
    }
}

/// Which class goes next.
#[derive(Debug)]
pub struct Rows {
    regular: Regular,
    next: u8,
    rounds: u32,
    over: bool,
}

impl Rows {
    /// Before the first level.
    pub fn new(regular: Regular) -> Self {
        Self { regular, next: 0, rounds: 0, over: regular == Regular::Ignored }
    }

    /// There are no more classes.
    pub fn end(&mut self) {
        self.over = true;
    }

    /// The pattern of the next level, if it has one.
    pub fn next_level(&mut self, remover: &mut Remover) -> Option<Pattern> {
        if self.over {
            return None;
        }
        let mut pattern = if self.next == 0 {
            let (pattern, seconds) = timed(|| {
                let classes = Classes::new(&remover.table, |v| remover.places.at(v));
                Pattern::new(&remover.table, remover.corners(), classes)
            });
            remover.watch.seconds.classes += seconds;
            self.rounds += 1;
            let follows = pattern.is_exact() && self.rounds <= ROUNDS;
            // Rows are worth a preference where they are one choice among many: on a part of planes and cylinders what goes is what is flat.
            let prefers = self.regular == Regular::Preferred && pattern.classes.fit >= FIT;
            if !(follows || (prefers && remover.is_bent_alike())) {
                self.over = true;
                return None;
            }
            pattern
        } else {
            remover.pattern.take().expect("the levels of a pattern follow each other")
        };
        let class = self.next;
        self.next = (class + 1) % 3;
        // The soonest class has the highest rank; what has gone or has no class ranks as what goes next but one.
        let rank = |c: u8| if c < class { 0 } else { 3 - c };
        pattern.class = class;
        pattern.ranks = [rank(0), rank(1), rank(2), 0, 1];
        Some(pattern)
    }
}

/// What an edge costs for each rank of its two ends, in mean edges, where so many edges fit the pattern. What fits by chance will not be
/// regular after a round either; only what fits beyond that saves bits, in return for triangles that are not where the surface needs them.
fn preference(fit: f64) -> f32 {
    PREFERENCE * ((fit - CHANCE) / (1.0 - CHANCE)).max(0.0) as f32
}

/// The vertices near which nearly all triangles have three classes.
///
/// By chance about three quarters have. Where the pattern meets itself along a seam, two of the classes that go change places: that does no harm, so
/// it counts less than two neighbours that should both stay.
fn holds(table: &CornerTable, class: &[u8]) -> BitVec {
    let worth = |t: Triangle| {
        let [x, y, z] = table.triangle(t).map(|v| class[v.index()]);
        let stay = [x, y, z].iter().filter(|&&c| c == STAYS).count();
        match (x != y && y != z && z != x, stay) {
            _ if [x, y, z].contains(&NONE) => 0.0,
            (true, _) => 1.0,
            (false, 0 | 1) => SEAM,
            (false, _) => -1.0,
        }
    };
    let mut of_triangles: Vec<f32> = Vec::with_capacity(table.triangle_count());
    of_triangles.extend(table.triangles().map(worth));
    let [mut counts, mut sums, mut means] = [(); 3].map(|()| vec![0.0f32; table.vertex_slots()]);
    table.triangles().flat_map(|t| table.triangle(t)).for_each(|v| counts[v.index()] += 1.0);
    for _ in 0..RINGS {
        sums.fill(0.0);
        for (t, worth) in table.triangles().zip(&of_triangles) {
            table.triangle(t).iter().for_each(|v| sums[v.index()] += worth);
        }
        for ((mean, sum), count) in means.iter_mut().zip(&sums).zip(&counts) {
            *mean = sum / count;
        }
        for (t, worth) in table.triangles().zip(&mut of_triangles) {
            let [a, b, c] = table.triangle(t).map(|v| means[v.index()]);
            *worth = (a + b + c) / 3.0;
        }
    }
    let mut holds = bitvec![0; table.vertex_slots()];
    for v in vertices(table) {
        holds.set(v.index(), sums[v.index()] >= NEARLY as f32 * counts[v.index()]);
    }
    holds
}

/// The last class that goes, and the one that stays.
const LAST: u8 = 2;
const STAYS: u8 = 3;

/// What a triangle on a seam is worth beside one of three classes.
const SEAM: f32 = 0.6;
/// How often what holds is averaged with what holds next to it.
const RINGS: u32 = 8;
/// Share of the triangles near a vertex that must fit for the pattern to hold there, and of the vertices that it must hold at.
const NEARLY: f64 = 0.9;
/// Rounds that follow a pattern exactly: they take fifteen vertices of sixteen, and few bits are left to save; but the few vertices
/// that then remain had better be where the surface needs them.
const ROUNDS: u32 = 2;
/// Share of edges that classes must fit to be preferred.
const FIT: f64 = 0.65;
/// The share that fits by chance.
const CHANCE: f64 = 0.5;

/// What an edge costs for each rank of its two ends, in mean edges, where a pattern that fits everywhere is a preference: enough that it goes
/// on where the surface is smooth.
const PREFERENCE: f32 = 2.0;
/// The same where the pattern comes first: more than the shapes of a polygon's triangles may make.
const FIRST: f32 = 1e4;
/// What comes second, before shapes.
const SECOND: f32 = 1e3;
/// A direction that rows are neither along nor square to, nor at the same angle to both diagonals of their cells: of 1, √2 and √3.
const ODD: Vec3 = Vec3::new(0.408_248_3, 0.577_350_3, std::f32::consts::FRAC_1_SQRT_2);

#[cfg(test)]
mod tests {
    use super::super::{Features, Options, Values, simplify};
    use super::*;
    use crate::mesh::{IndexedMesh, Lattice, lattice, shapes};
    use glam::DVec3;

    /// The tables of level 0 and of the first levels after it, under default settings.
    fn levels(mesh: &IndexedMesh, count: usize) -> Vec<CornerTable> {
        levels_by(mesh, count, Options::default())
    }

    fn levels_by(mesh: &IndexedMesh, count: usize, options: Options) -> Vec<CornerTable> {
        levels_of(mesh, Features::default(), count, options)
    }

    fn levels_of(mesh: &IndexedMesh, features: Features, count: usize, options: Options) -> Vec<CornerTable> {
        let table = CornerTable::from_triangles(mesh.positions.len(), &mesh.triangles).unwrap();
        let (min, max) = lattice::bounds(mesh.positions.iter().copied()).unwrap();
        let lattice = Lattice::over(min, max, 14);
        let locked = bitvec![0; mesh.positions.len()];
        let options = Options { base_vertices: Some(20), ..options };
        let done =
            simplify(table.clone(), &mesh.positions, locked, features, &lattice, &options, &mut |_, _| true)
                .unwrap();
        let mut levels = vec![table];
        for j in 0..count {
            let mut table = levels[j].clone();
            done.history.undo_level(&mut table, j).unwrap();
            levels.push(table);
        }
        levels
    }

    fn count(table: &CornerTable, fits: impl Fn(Vertex) -> bool) -> usize {
        vertices(table).filter(|&v| fits(v)).count()
    }

    /// A height field over squares, cut as `other` says.
    fn sheet(n: u32, other: impl Fn(u32, u32) -> bool, height: impl Fn(u32, u32) -> f64) -> IndexedMesh {
        let mut mesh = shapes::grid(n, n);
        for (k, p) in mesh.positions.iter_mut().enumerate() {
            let [i, j] = [k as u32 % (n + 1), k as u32 / (n + 1)];
            *p = [i.into(), j.into(), height(i, j)];
        }
        for (k, pair) in mesh.triangles.chunks_mut(2).enumerate() {
            let [i, j] = [k as u32 % n, k as u32 / n];
            if other(i, j) {
                let corner = |di: u32, dj: u32| (j + dj) * (n + 1) + i + di;
                let [a, b, c, d] = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
                pair.copy_from_slice(&[[a, b, d], [b, c, d]]);
            }
        }
        mesh
    }

    fn waves(i: u32, j: u32) -> f64 {
        2.0 * (f64::from(i) / 5.0).sin() * (f64::from(j) / 7.0).cos()
    }

    /// Three levels take half of the rows and half of the columns; what is left is a regular torus again, since the last class gives way to
    /// the edges between its mates. Three further levels do the same.
    #[test]
    fn two_rounds_leave_every_fourth_row_as_regular_as_before() {
        let levels = levels(&shapes::torus(96, 48), 6);
        let sizes: Vec<_> = levels.iter().map(|table| count(table, |_| true)).collect();
        assert_eq!(sizes, [4608, 3456, 2304, 1152, 864, 576, 288]);
        let torus = shapes::torus(96, 48);
        let ignored = levels_by(&torus, 1, Options { regular: Regular::Ignored, ..Options::default() });
        assert_ne!(count(&ignored[1], |_| true), 3456, "it is the rows that make these sizes");
        for table in [&levels[3], &levels[6]] {
            assert_eq!(count(table, |v| table.valence(v) == 6), count(table, |_| true));
        }
    }

    /// Normals are those of the torus, or at every fourth ring of another surface.
    #[test]
    fn rows_are_not_followed_over_creases() {
        let torus = shapes::torus(96, 48);
        let table = CornerTable::from_triangles(torus.positions.len(), &torus.triangles).unwrap();
        let after = |is_odd: &dyn Fn(Vertex) -> bool| {
            let normal = |v: Vertex| {
                let at = |w: Vertex| DVec3::from_array(torus.positions[w.index()]);
                let sum: DVec3 = table
                    .fan(v)
                    .map(|c| (at(table.vertex(c.next())) - at(v)).cross(at(table.vertex(c.prev())) - at(v)))
                    .sum();
                let normal = 0.02 * sum.normalize_or_zero();
                if is_odd(v) { DVec3::new(normal.y, normal.z, normal.x) } else { normal }
            };
            let mut corners = vec![[0; 4]; table.slots()];
            for c in table.triangles().flat_map(|t| t.corners()) {
                corners[c.triangle().index()][c.place()] = table.vertex(c).0;
            }
            let rows = (0..torus.positions.len() as u32).flat_map(|v| normal(Vertex(v)).as_vec3().to_array());
            let values =
                Values { corners, width: 3, rows: rows.collect(), normals: vec![0], ..Values::default() };
            let features = Features { values, ..Features::default() };
            count(&levels_of(&torus, features, 1, Options::default())[1], |_| true)
        };
        assert_eq!(after(&|_| false), 3456);
        assert_ne!(after(&|v| v.0 % 4 == 0), 3456);
    }

    /// Between four vertices that stay one diagonal is as good as the other, but all are to run the same way.
    #[test]
    fn alternating_diagonals_become_parallel() {
        let levels = levels(&sheet(64, |i, j| (i + j) % 2 == 1, waves), 3);
        let table = &levels[3];
        let inside = |v: Vertex| !table.is_boundary(v);
        let six = count(table, |v| inside(v) && table.valence(v) == 6);
        assert!(six * 20 > 19 * count(table, inside), "{six} of {}", count(table, inside));
    }

    /// A spike stands on a vertex that the rows would take.
    #[test]
    fn features_stay() {
        let spike = |i, j| waves(i, j) + if (i, j) == (32, 31) { 9.0 } else { 0.0 };
        let levels = levels(&sheet(64, |_, _| false, spike), 3);
        let at = Vertex(31 * 65 + 32);
        let unspiked = self::levels(&sheet(64, |_, _| false, waves), 3);
        let gone: Vec<_> = unspiked.iter().map(|table| table.corner_of(at).is_none()).collect();
        assert!(levels[3].corner_of(at).is_some());
        assert!(gone[3], "{gone:?}");
    }

    fn exact(mesh: &IndexedMesh) -> bool {
        let table = CornerTable::from_triangles(mesh.positions.len(), &mesh.triangles).unwrap();
        let classes = Classes::new(&table, |v| DVec3::from_array(mesh.positions[v.index()]));
        Pattern::new(&table, None, classes).is_exact()
    }

    /// Rows may run either way, round corners, and along seams; but a mesh that is no sampling of rows, or half of one, has no pattern.
    #[test]
    fn a_pattern_holds_nearly_everywhere_or_not_at_all() {
        let random = |i: u32, j: u32| {
            (i.wrapping_mul(0x9e37_79b1) ^ j.wrapping_mul(0x85eb_ca6b)).count_ones().is_multiple_of(2)
        };
        assert!(exact(&sheet(40, random, waves)));
        assert!(exact(&shapes::sphere(4)) && exact(&shapes::torus(25, 41)));
        // Most triangles of a level of an ordinary simplification have three classes by chance.
        let torus = shapes::torus(96, 48);
        let level = &levels_by(&torus, 9, Options { regular: Regular::Followed, ..Options::default() })[9];
        let triangles: Vec<[u32; 3]> = level.triangles().map(|t| level.triangle(t).map(|v| v.0)).collect();
        assert!(!exact(&IndexedMesh::new(torus.positions.clone(), triangles)));
        assert!(!exact(&half_a_sheet()));
    }

    /// A sheet of 49 by 49 vertices, of whose one half, the first rows, many edges have been flipped.
    fn half_a_sheet() -> IndexedMesh {
        let mesh = sheet(48, |_, _| false, waves);
        let mut table = CornerTable::from_triangles(mesh.positions.len(), &mesh.triangles).unwrap();
        let mut random = crate::mesh::random::SplitMix64::new(1);
        let mut flipped = 0;
        while flipped < 1500 {
            let t = Triangle(random.below(table.slots() as u32 / 2));
            let c = t.corner(0);
            let o = table.opposite(c);
            if o.is_some() && !table.has_edge(table.vertex(c), table.vertex(o)) {
                crate::refine::stellar::flip(&mut table, c);
                flipped += 1;
            }
        }
        let triangles = table.triangles().map(|t| table.triangle(t).map(|v| v.0)).collect();
        IndexedMesh::new(mesh.positions, triangles)
    }

    /// An edge between two vertices of the class that goes costs the less the fewer edges fit the pattern, and nothing where half of them do,
    /// as anywhere.
    #[test]
    fn what_fits_little_is_preferred_little() {
        let mesh = half_a_sheet();
        let table = CornerTable::from_triangles(mesh.positions.len(), &mesh.triangles).unwrap();
        let bias = |fit: f64| {
            let classes = Classes { of: vec![0; mesh.positions.len()], fit };
            let mut pattern = Pattern::new(&table, None, classes);
            pattern.ranks = [3, 2, 1, 0, 1];
            assert!(!pattern.is_exact());
            pattern.bias(Vertex(0), [Vertex(1), Vertex(2)], Vec3::X)
        };
        let [full, most, little] = [1.0, 0.9, 0.6].map(bias);
        assert!(full > 0.0 && (most / full - 0.8).abs() < 1e-3 && (little / full - 0.2).abs() < 1e-3);
        assert_eq!([0.5, 0.4].map(bias), [0.0; 2]);
    }

    /// Where only half of the mesh has rows, they are preferred there: of four classes, one makes up most of what stays.
    #[test]
    fn rows_are_preferred_where_they_are() {
        let mesh = half_a_sheet();
        let most = |regular: Regular| {
            let levels = levels_by(&mesh, 3, Options { regular, ..Options::default() });
            let mut classes = [0u32; 4];
            for Vertex(v) in vertices(&levels[3]) {
                let [i, j] = [v % 49, v / 49];
                classes[(i % 2 + 2 * (j % 2)) as usize] += u32::from(j > 28);
            }
            f64::from(classes.into_iter().max().unwrap_or(0)) / f64::from(classes.iter().sum::<u32>())
        };
        let shares = [Regular::Preferred, Regular::Followed].map(most);
        assert!(shares[0] > shares[1] + 0.15, "{shares:?}");
        assert_eq!(Options::default().regular, Regular::Preferred);
    }
}
