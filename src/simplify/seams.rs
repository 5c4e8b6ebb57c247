//! Charts inside a mesh: where those of an attribute meet, and how vertices there go.
//!
//! Charts meet along borders, curves that end in corners. A vertex with two of them is removed along its curve, a–v–b becoming a–b on both
//! sides at once. Where a border ends, where several meet, and where one meets the boundary, the vertex goes onto one of its link along a
//! border, as an edge collapse does: the part of each chart that was round it is then a fan from there, but for triangles at the edge
//! collapsed, with which a chart may vanish. So no triangle ever has corners in two charts.

use super::bodies::Bodies;
use super::star::Star;
use super::values::Values;
use crate::refine::labels::Parting;

/// What a simplification keeps besides locked vertices and the boundary, or pays for.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Features {
    /// Whether all charts are kept at all levels. Otherwise coarse levels know but of those that must be: those at most of whose vertices
    /// others meet, or from which no vertex could go.
    pub binding: bool,
    /// What corners are worth, and the charts that they are of.
    pub values: Values,
    /// Which vertices are of which body: how far a level is off is asked of its own alone.
    pub bodies: Bodies,
}

/// How a vertex may go.
#[derive(Clone, Debug)]
pub enum Ways {
    /// Any edge may take its place.
    Free,
    /// The edge between two places on its link is left.
    Along((usize, usize)),
    /// Onto one of its link.
    Onto(Onto),
}

/// The places that a vertex may go onto.
#[derive(Clone, Debug)]
pub struct Onto {
    triangles: usize,
    is_open: bool,
    borders: u64,
    left: u64,
}

impl Iterator for Onto {
    type Item = Parting;

    fn next(&mut self) -> Option<Parting> {
        let place = (self.left != 0).then(|| self.left.trailing_zeros() as usize)?;
        self.left &= self.left - 1;
        Some(Parting::onto(self.triangles, self.is_open, place, self.borders))
    }
}

impl Ways {
    /// Those of a vertex from which borders lead to some places on its link, bits.
    pub fn new(star: &Star, borders: u64) -> Self {
        let (places, triangles, is_open) = (star.ring().len(), star.normals().len(), star.boundary);
        let onto = |borders: u64, left: u64| Self::Onto(Onto { triangles, is_open, borders, left });
        let first = borders.trailing_zeros() as usize;
        match (borders.count_ones(), is_open) {
            (0, _) => Self::Free,
            (_, true) => onto(borders, 1 | 1 << triangles),
            // Its end moves to where the border may best go on to.
            (1, _) => match straight_on(star, first) {
                Some(end) => Self::Along((first.min(end), first.max(end))),
                None => onto(1 << first | 1 << ((first + 1) % places), 1 << first),
            },
            (2, _) => {
                let last = 63 - borders.leading_zeros() as usize;
                // An edge joins them already: the triangle at it goes.
                if last - first == 1 || last - first == places - 1 {
                    onto(borders, 1 << first)
                } else {
                    Self::Along((first, last))
                }
            }
            _ => onto(borders, borders),
        }
    }
}

/// The place, no neighbour of another one, from which an edge to that comes nearest to the vertex.
fn straight_on(star: &Star, from: usize) -> Option<usize> {
    let places = star.ring().len();
    let off = |&place: &usize| star.foot([[from, from, place]].into_iter()).length_squared();
    let others = (0..places).filter(|&place| (2..places - 1).contains(&((place + places - from) % places)));
    others.min_by(|x, y| off(x).total_cmp(&off(y)))
}

#[cfg(test)]
mod tests {
    use super::super::removal::vertices;
    use super::super::{Method, Options, Simplified, simplify};
    use super::*;
    use crate::mesh::random::SplitMix64;
    use crate::mesh::{Corner, CornerTable, IndexedMesh, Lattice, Triangle, Vertex, lattice, shapes};
    use crate::refine::{Labels, Ring};
    use bitvec::vec::BitVec;
    use std::collections::{BTreeSet, HashMap};

    fn table(mesh: &IndexedMesh) -> CornerTable {
        CornerTable::from_triangles(mesh.positions.len(), &mesh.triangles).unwrap()
    }

    /// What corners are in charts: their vertex, and what `of` tells of them there.
    fn charts(table: &CornerTable, of: impl Fn(Corner) -> u32) -> Values {
        let mut values = Values { corners: vec![[0; 4]; table.slots()], ..Values::default() };
        let mut rows = HashMap::new();
        for c in table.triangles().flat_map(|t| t.corners()) {
            let next = rows.len() as u32;
            let row = *rows.entry((table.vertex(c), of(c))).or_insert(next);
            values.corners[c.triangle().index()][c.place()] = row;
        }
        values.charts = (0..rows.len() as u32).map(|row| [row, 0]).collect();
        values
    }

    /// Those of which each triangle is of one, `of` telling of which.
    fn charts_of(table: &CornerTable, of: impl Fn(Triangle) -> u32) -> Values {
        charts(table, |c| of(c.triangle()))
    }

    /// Which of some random vertices is nearest to a triangle.
    fn cells(mesh: &IndexedMesh, table: &CornerTable, count: u32, seed: u64) -> Vec<u32> {
        let mut random = SplitMix64::new(seed);
        let sites: Vec<_> = (0..count).map(|_| random.below(mesh.positions.len() as u32) as usize).collect();
        let cell = |t: Triangle| {
            let p = mesh.positions[table.triangle(t)[0].index()];
            let apart = |&s: &usize| (0..3).map(|k| (p[k] - mesh.positions[s][k]).powi(2)).sum::<f64>();
            let nearest = (0..).zip(&sites).min_by(|x, y| apart(x.1).total_cmp(&apart(y.1)));
            nearest.map_or(0, |x| x.0)
        };
        (0..table.slots() as u32).map(|t| cell(Triangle(t))).collect()
    }

    /// One edge in so many is a border wherever it is, as far as corners can tell: where a vertex has but one, it is none there.
    fn scattered(table: &CornerTable, one_in: u32, seed: u64) -> Values {
        let is_border = |c: Corner| {
            let edge = c.0.min(table.opposite(c).0);
            table.opposite(c).is_some() && SplitMix64::new(seed ^ u64::from(edge) << 20).below(one_in) == 0
        };
        let mut of = HashMap::new();
        for v in vertices(table) {
            let borders: Vec<bool> = table.fan(v).map(|c| is_border(c.prev())).collect();
            let count = borders.iter().filter(|&&border| border).count() as u32;
            let mut part = 0;
            for (c, border) in table.fan(v).zip(borders) {
                part += u32::from(border);
                of.insert(c, if table.is_boundary(v) { part } else { part % count.max(1) });
            }
        }
        charts(table, |c| of[&c])
    }

    fn run(mesh: &IndexedMesh, values: &Values, options: &Options) -> (CornerTable, Simplified) {
        run_with(mesh, Features { values: values.clone(), binding: true, ..Features::default() }, options)
    }

    fn run_with(mesh: &IndexedMesh, features: Features, options: &Options) -> (CornerTable, Simplified) {
        let table = table(mesh);
        let (min, max) = lattice::bounds(mesh.positions.iter().copied()).unwrap();
        let lattice = Lattice::over(min, max, 14);
        let locked = BitVec::repeat(false, mesh.positions.len());
        let done =
            simplify(table.clone(), &mesh.positions, locked, features, &lattice, options, &mut |_, _| true);
        (table, done.unwrap())
    }

    /// Rows of which some triangle has both are of one chart: for each row one of its chart.
    fn joined(values: &Values) -> Vec<u32> {
        let mut of: Vec<u32> = (0..values.charts.len() as u32).collect();
        let root = |of: &[u32], mut row: u32| {
            while of[row as usize] != row {
                row = of[row as usize];
            }
            row
        };
        for [a, b, c, _] in &values.corners {
            for other in [b, c] {
                let [x, y] = [a, other].map(|&row| root(&of, row));
                of[x as usize] = y;
            }
        }
        (0..of.len() as u32).map(|row| root(&of, row)).collect()
    }

    /// Takes the history back, labelled as an encoder does it, and checks at every level with charts that no triangle mixes them, that the edge
    /// between its neighbours is a border where a vertex has gone from a curve, and that triangles of other kinds never stand for each other.
    /// Returned are how many vertices have gone from curves, and how many onto others.
    fn check(values: &Values, table: &CornerTable, done: &Simplified) -> [usize; 2] {
        let (mut mesh, mut labels) = (table.clone(), Labels::new(values.corners.clone()));
        let of = joined(values);
        let (mut ring, mut slid) = (Ring::default(), done.slid.iter().peekable());
        let mut along = 0;
        for j in 0..done.charts_to {
            for operation in done.history.level(j) {
                let v = operation.vertex;
                labels.ring(&mesh, v, operation.site, &mut ring);
                let kinds: BTreeSet<u32> = ring.labels.iter().map(|labels| labels[3]).collect();
                let moved = slid.next_if(|slid| slid.vertex == v);
                let parting =
                    moved.map_or_else(|| ring.parting(operation.site), |moved| ring.parting_of(moved));
                let borders = borders(&mesh, &labels, v);
                operation.undo(&mut mesh, done.history.flips(operation)).unwrap();
                labels.settle(&mesh, &ring, operation.site, parting, |_, _| false);
                if let ([a, b], None) = (&borders[..], moved) {
                    along += 1;
                    // Where both ends are the same on both sides, it was one but for the vertex.
                    let c = mesh.find_edge(a.0, b.0);
                    let is_one = is_border(&mesh, &labels, c);
                    assert!(c.is_some() && is_one == (a.1 || b.1), "{operation:?} leaves no border");
                }
                let there = ring.corners.iter().map(|c| c.triangle());
                let there = there.filter(|t| t.index() < mesh.slots() && mesh.is_live(*t));
                let left: BTreeSet<u32> = there.map(|t| labels.of_triangle(t)).collect();
                assert!(left == kinds || ring.labels.len() == 1, "{operation:?}");
            }
            assert_eq!(mesh.check(), Ok(()));
            for t in mesh.triangles() {
                let charts = t.corners().map(|c| of[labels.of(c) as usize]);
                assert_eq!(charts, [charts[0]; 3], "{t:?} mixes charts at level {}", j + 1);
            }
        }
        assert!(slid.peek().is_none() || done.charts_to < done.history.level_count());
        for j in done.charts_to..done.history.level_count() {
            done.history.undo_level(&mut mesh, j).unwrap();
        }
        let [mut left, mut base] = [mesh.clone(), done.base.clone()];
        // Simplification gives the places of removed triangles back at times.
        left.close_up();
        base.close_up();
        assert!(left == base);
        for j in (0..done.history.level_count()).rev() {
            done.history.apply_level(&mut mesh, j).unwrap();
        }
        assert_eq!(mesh.triangle_count(), table.triangle_count());
        [along, done.slid.len()]
    }

    fn is_border(table: &CornerTable, labels: &Labels, c: Corner) -> bool {
        let o = table.opposite(c);
        let of = |c: Corner| labels.of(c);
        o.is_some() && [of(c.next()), of(c.prev())] != [of(o.prev()), of(o.next())]
    }

    /// The ends of the borders at a vertex inside, and whether they are two there, too.
    fn borders(table: &CornerTable, labels: &Labels, v: Vertex) -> Vec<(Vertex, bool)> {
        if table.is_boundary(v) {
            return Vec::new();
        }
        let spokes = table.fan(v).filter(|c| is_border(table, labels, c.prev()));
        let parts = |c: Corner| labels.of(c.next()) != labels.of(table.opposite(c.prev()).next());
        spokes.map(|c| (table.vertex(c.next()), parts(c))).collect()
    }

    /// All profiles, both methods, down to where nothing goes any more.
    fn settings() -> impl Iterator<Item = Options> {
        let profiles = [Options::default(), Options::small(), Options::fine()];
        let both = |options: Options| {
            [Method::Stellar, Method::Ffc].map(|method| Options {
                method,
                base_vertices: Some(0),
                ..options.clone()
            })
        };
        profiles.into_iter().flat_map(both)
    }

    #[test]
    fn no_triangle_mixes_charts() {
        let meshes = [
            shapes::torus(24, 36),
            shapes::bumpy_sphere(4, 3),
            shapes::annulus(200),
            shapes::grid(20, 30),
            shapes::handle_body(3),
            shapes::torus_with_hole(20, 12),
            shapes::two_components(),
        ];
        let mut gone = [0; 2];
        for (k, mesh) in (0..).zip(&meshes) {
            let table = table(mesh);
            for options in settings() {
                let cells = [2, 60].map(|count| {
                    let cells = cells(mesh, &table, count, 10 * k + u64::from(count));
                    charts_of(&table, |t| cells[t.index()])
                });
                for values in cells.into_iter().chain([3, 30].map(|one_in| scattered(&table, one_in, k))) {
                    let (table, done) = run(mesh, &values, &options);
                    let [along, onto] = check(&values, &table, &done);
                    gone = [gone[0] + along, gone[1] + onto];
                }
            }
        }
        assert!(
            gone.iter().all(|&gone| gone > 1000),
            "{gone:?} vertices have gone along curves and onto others"
        );
    }

    /// Where every edge is a border, and where every triangle is of another kind.
    #[test]
    fn charts_vanish_but_not_triangles_of_a_kind() {
        for mesh in [shapes::strip(9), shapes::disc_with_ears(), shapes::torus(8, 6), shapes::sphere(2)] {
            let table = table(&mesh);
            let mut values = charts_of(&table, |t| t.0);
            for options in settings() {
                let (table, done) = run(&mesh, &values, &options);
                check(&values, &table, &done);
                let free = run(&mesh, &Values::default(), &options).1;
                let [left, least, all] =
                    [&done.base, &free.base, &table].map(|table| vertices(table).count());
                assert!(left <= least + all / 4, "{left} of {all} are left, {least} without charts");
            }
            (0..).zip(&mut values.corners).for_each(|(t, corners)| corners[3] = t);
            for options in settings() {
                assert_eq!(run(&mesh, &values, &options).1.base, table);
            }
        }
    }

    /// Of each part there is something at every level.
    #[test]
    fn kinds_stay() {
        for (mesh, seed) in
            [shapes::torus(24, 36), shapes::bumpy_sphere(4, 3), shapes::grid(20, 30)].iter().zip(0..)
        {
            let table = table(mesh);
            let cells = cells(mesh, &table, 12, seed);
            let mut values = charts_of(&table, |t| cells[t.index()]);
            values.corners.iter_mut().zip(cells).for_each(|(corners, cell)| corners[3] = cell);
            for options in settings() {
                let (table, done) = run(mesh, &values, &options);
                let [along, onto] = check(&values, &table, &done);
                assert!(along > 20 && onto > 2, "{along} {onto}");
            }
        }
    }

    /// Where corners are most of a level, or nothing else goes, charts are given up.
    #[test]
    fn charts_are_given_up_where_they_meet_everywhere() {
        let (mut kept, mut gone) = (0, 0);
        for mesh in [shapes::torus(24, 36), shapes::bumpy_sphere(4, 3), shapes::grid(20, 30)] {
            let table = table(&mesh);
            for options in [Options::default(), Options { method: Method::Ffc, ..Options::fine() }] {
                let options = Options { base_vertices: Some(40), ..options };
                let cells = [2, 60].map(|count| {
                    let cells = cells(&mesh, &table, count, 5);
                    charts_of(&table, |t| cells[t.index()])
                });
                for values in cells.into_iter().chain([scattered(&table, 3, 5)]) {
                    let features = Features { values: values.clone(), ..Features::default() };
                    let (table, done) = run_with(&mesh, features, &options);
                    check(&values, &table, &done);
                    assert!(vertices(&done.base).count() <= 40);
                    if done.charts_to == done.history.level_count() { kept += 1 } else { gone += 1 }
                }
            }
        }
        assert!(kept >= 4 && gone >= 4, "{kept} kept, {gone} given up");
    }

    /// Where charts of two kinds are given up, those that must stay do.
    #[test]
    fn some_charts_are_kept_where_others_are_given_up() {
        for mesh in [shapes::torus(24, 36), shapes::bumpy_sphere(4, 3), shapes::grid(20, 30)] {
            let table = table(&mesh);
            for options in settings() {
                let cells = cells(&mesh, &table, 3, 5);
                let kept = charts_of(&table, |t| cells[t.index()]);
                let others = scattered(&table, 3, 5);
                // Rows of both.
                let mut rows = HashMap::new();
                let mut values = Values { corners: kept.corners.clone(), ..Values::default() };
                for (corners, of) in values.corners.iter_mut().zip(&others.corners) {
                    for (row, &other) in corners[..3].iter_mut().zip(of) {
                        let next = rows.len() as u32;
                        let pair = (*row, other);
                        *row = *rows.entry(pair).or_insert(next);
                        if *row == next {
                            values.charts.push([next, pair.0]);
                        }
                    }
                }
                let features = Features { values: values.clone(), ..Features::default() };
                let (_, mut done) = run_with(&mesh, features, &options);
                assert!(done.charts_to < done.history.level_count());
                check(&values, &table, &done);
                // All of its levels have those.
                done.charts_to = done.history.level_count();
                check(&kept, &table, &done);
            }
        }
    }

    /// On a plane everything goes for nothing but a border's bends: it stays as near as the bends that are left allow.
    #[test]
    fn a_curve_stays_where_it_is() {
        // A square of two charts, whose border is a circle.
        let mut mesh = shapes::grid(40, 40);
        mesh.positions.iter_mut().for_each(|p| p[2] = 0.0);
        let table = table(&mesh);
        let inside = |t: Triangle| {
            let sum = table.triangle(t).map(|v| mesh.positions[v.index()]);
            let middle = [0, 1].map(|k| sum.iter().map(|p| p[k]).sum::<f64>() / 3.0 - 20.0);
            u32::from(middle[0].hypot(middle[1]) < 14.0)
        };
        let mut values = charts_of(&table, inside);
        table.triangles().for_each(|t| values.corners[t.index()][3] = inside(t));
        let area = |table: &CornerTable, labels: &Labels| {
            let of = |t: Triangle| {
                let [a, b, c] = table.triangle(t).map(|v| mesh.positions[v.index()]);
                0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))
            };
            table.triangles().filter(|&t| labels.of_triangle(t) == 1).map(of).sum::<f64>()
        };
        let (mut level, done) =
            run(&mesh, &values, &Options { base_vertices: Some(80), ..Options::default() });
        let (mut labels, mut ring) = (Labels::new(values.corners.clone()), Ring::default());
        let before = area(&level, &labels);
        let mut slid = done.slid.iter().peekable();
        for operation in done.history.operations() {
            labels.ring(&level, operation.vertex, operation.site, &mut ring);
            let moved = slid.next_if(|slid| slid.vertex == operation.vertex);
            let parting = moved.map_or_else(|| ring.parting(operation.site), |moved| ring.parting_of(moved));
            operation.undo(&mut level, done.history.flips(operation)).unwrap();
            labels.settle(&level, &ring, operation.site, parting, |_, _| false);
        }
        let after = area(&level, &labels);
        assert!((after / before - 1.0).abs() < 0.02, "{after} for {before}");
    }
}
