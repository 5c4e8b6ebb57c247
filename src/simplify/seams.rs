//! Feature edges inside a mesh: where charts of an attribute meet, which removals leave standing.
//!
//! A chart's border is made of curves that end in corners. A vertex with two seams is removed along its curve, a–v–b becoming a–b on both
//! sides at once; where a seam ends, where several meet, and where one meets the boundary, the vertex stays. Then no triangle ever has
//! corners in two charts, curves are only shortened, and a vertex is of as many charts at each level that it is in.

use super::bodies::Bodies;
use super::values::Values;
use crate::error::{Error, Result};
use crate::mesh::topology::{VertexClass, classify};
use crate::mesh::{Corner, CornerTable, Triangle, Vertex};
use bitvec::vec::BitVec;

/// What a simplification keeps besides locked vertices and the boundary, or pays for.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Features {
    /// Borders of charts: a bit a corner number, four a triangle, set at one or both sides of a seam for the edge opposite; empty where
    /// there are none.
    pub seams: BitVec,
    /// Those of them, told in the same way, that are kept at all levels; empty where there are none.
    pub kept: BitVec,
    /// Whether all are kept at all levels. Otherwise coarse levels know of no other seam: those of which half the vertices would stay for
    /// nothing but a seam, or from which no vertex could go.
    pub binding: bool,
    /// What corners are worth.
    pub values: Values,
    /// Which vertices are of which body: how far a level is off is asked of its own alone.
    pub bodies: Bodies,
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
    /// The same of those that are left where the others are given up, if there are others.
    kept: Option<Box<Seams>>,
}

impl Seams {
    /// Those of a mesh, and of them `kept`; `None` where it has none.
    ///
    /// # Errors
    /// [`Error::Parameter`] where there are bits, but not four a triangle.
    pub fn new(table: &CornerTable, of: BitVec, kept: BitVec) -> Result<Option<Self>> {
        let (mut all, kept) = (Self::all(table, of)?, Self::all(table, kept)?);
        if let Some(all) = &mut all {
            all.kept = kept.filter(|kept| kept.of != all.of).map(Box::new);
            if let Some(kept) = &all.kept {
                all.corners |= &kept.corners;
            }
        }
        Ok(all)
    }

    fn all(table: &CornerTable, mut of: BitVec) -> Result<Option<Self>> {
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
        Ok(Some(Self { of, curved, corners, kept: None }))
    }

    /// What is left where all that need not stay are given up.
    pub fn into_kept(self) -> Option<Self> {
        self.kept.map(|kept| *kept)
    }

    /// The vertices that must stay for those that stay.
    pub fn kept_corners(&self) -> Option<&BitVec> {
        self.kept.as_ref().map(|kept| &kept.corners)
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

    /// The triangles that are left, in order, are now numbered as in this list.
    pub fn compact(&mut self, there: &[Triangle]) {
        for (k, t) in there.iter().enumerate() {
            for place in 0..4 {
                let is_seam = self.of[4 * t.index() + place];
                self.of.set(4 * k + place, is_seam);
            }
        }
        self.of.truncate(4 * there.len());
        if let Some(kept) = &mut self.kept {
            kept.compact(there);
        }
    }

    /// Some triangles are new, in place of the star of `v`; between them only the edge between the ends of `curve`, which `v` was on, is a
    /// seam.
    pub fn renew(
        &mut self,
        table: &CornerTable,
        triangles: &[Triangle],
        v: Vertex,
        curve: Option<[Vertex; 2]>,
    ) {
        if let Some(kept) = &mut self.kept {
            // Both halves of a curve are of the same charts.
            let curve = curve.filter(|_| kept.curved[v.index()]);
            kept.renew(table, triangles, v, curve);
        }
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

#[cfg(test)]
mod tests {
    use super::super::removal::vertices;
    use super::super::{Method, Options, Simplified, simplify};
    use super::*;
    use crate::mesh::random::SplitMix64;
    use crate::mesh::{IndexedMesh, Lattice, lattice, shapes};
    use crate::refine::Site;
    use std::collections::{BTreeMap, BTreeSet};

    fn table(mesh: &IndexedMesh) -> CornerTable {
        CornerTable::from_triangles(mesh.positions.len(), &mesh.triangles).unwrap()
    }

    fn bits(table: &CornerTable, is_seam: impl Fn(Corner) -> bool) -> BitVec {
        let mut seams: BitVec = BitVec::repeat(false, 4 * table.slots());
        for c in table.triangles().flat_map(|t| t.corners()) {
            seams.set(c.index(), table.opposite(c).is_some() && is_seam(c));
        }
        seams
    }

    /// Where the nearest of some random vertices changes from triangle to triangle; only on the side of the smaller corner, as an input
    /// may say it.
    fn cells(mesh: &IndexedMesh, table: &CornerTable, count: u32, seed: u64) -> BitVec {
        let mut random = SplitMix64::new(seed);
        let sites: Vec<_> = (0..count).map(|_| random.below(mesh.positions.len() as u32) as usize).collect();
        let cell = |t: Triangle| {
            let p = mesh.positions[table.triangle(t)[0].index()];
            let apart = |&s: &usize| (0..3).map(|k| (p[k] - mesh.positions[s][k]).powi(2)).sum::<f64>();
            sites.iter().enumerate().min_by(|x, y| apart(x.1).total_cmp(&apart(y.1))).map(|x| x.0)
        };
        bits(table, |c| c < table.opposite(c) && cell(c.triangle()) != cell(table.opposite(c).triangle()))
    }

    /// One edge in so many, wherever it is.
    fn scattered(table: &CornerTable, one_in: u32, seed: u64) -> BitVec {
        bits(table, |c| {
            let edge = c.0.min(table.opposite(c).0);
            SplitMix64::new(seed ^ u64::from(edge) << 20).below(one_in) == 0
        })
    }

    fn run(mesh: &IndexedMesh, seams: &BitVec, options: &Options) -> (CornerTable, Simplified) {
        run_with(mesh, Features { seams: seams.clone(), binding: true, ..Features::default() }, options)
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

    /// Edges as pairs of vertices, smaller first.
    fn edge(a: Vertex, b: Vertex) -> (Vertex, Vertex) {
        (a.min(b), a.max(b))
    }

    fn edges(table: &CornerTable, seams: &BitVec) -> BTreeSet<(Vertex, Vertex)> {
        let corners = table.triangles().flat_map(|t| t.corners());
        corners.filter(|c| seams[c.index()]).map(|c| table.edge(c)).map(|(a, b)| edge(a, b)).collect()
    }

    /// The charts as they are told by edges alone: of each directed seam or boundary edge the chart on its left. Panics where a chart's
    /// triangles do not agree.
    fn charts(table: &CornerTable, seams: &BTreeSet<(Vertex, Vertex)>) -> (Vec<usize>, usize) {
        let mut of = vec![usize::MAX; table.slots()];
        let mut count = 0;
        for first in table.triangles() {
            if of[first.index()] != usize::MAX {
                continue;
            }
            let mut open = vec![first];
            while let Some(t) = open.pop() {
                of[t.index()] = count;
                for c in t.corners() {
                    let (a, b) = table.edge(c);
                    let o = table.opposite(c);
                    if o.is_some() && !seams.contains(&edge(a, b)) && of[o.triangle().index()] == usize::MAX {
                        of[o.triangle().index()] = count;
                        open.push(o.triangle());
                    }
                }
            }
            count += 1;
        }
        (of, count)
    }

    /// Takes the history back vertex by vertex, seams as pairs of vertices beside it, and checks all that is promised of levels with whole
    /// charts. Returns how many vertices have gone from curves.
    fn check(seams: &BitVec, table: &CornerTable, done: &Simplified) -> usize {
        let mut mesh = table.clone();
        let mut edges = edges(table, seams);
        let (of, count) = charts(table, &edges);
        // By directed feature edge the chart on its left.
        let mut left: BTreeMap<_, _> = table
            .triangles()
            .flat_map(|t| t.corners())
            .map(|c| (table.edge(c), c))
            .filter(|&((a, b), c)| table.opposite(c).is_none() || edges.contains(&edge(a, b)))
            .map(|(directed, c)| (directed, of[c.triangle().index()]))
            .collect();
        let mut slid = 0;
        for j in 0..done.charts_to {
            for operation in done.history.level(j) {
                let v = operation.vertex;
                let at: Vec<_> = mesh.link(v).into_iter().filter(|&w| edges.contains(&edge(v, w))).collect();
                let boundary = mesh.is_boundary(v);
                let link = mesh.link(v);
                let ends = match at[..] {
                    [] if boundary => Some((link[0], link[link.len() - 1])),
                    [] => None,
                    [a, b] if !boundary => Some((a, b)),
                    _ => panic!("{v:?} has {} seams, boundary: {boundary}", at.len()),
                };
                operation.undo(&mut mesh, done.history.flips(operation)).unwrap();
                if let Some((a, b)) = ends {
                    for (a, b) in [(a, b), (b, a)] {
                        let halves = [left.remove(&(a, v)), left.remove(&(v, b))];
                        assert_eq!(halves[0], halves[1], "the same chart on both halves");
                        halves[0].and_then(|chart| left.insert((a, b), chart));
                    }
                }
                if let [a, b] = at[..] {
                    slid += 1;
                    assert!(edges.remove(&edge(a, v)) && edges.remove(&edge(v, b)));
                    assert!(edges.insert(edge(a, b)), "two curves become one at {a:?} {b:?}");
                    assert!(mesh.has_edge(a, b));
                    // So that both sides' wedges come to be on one edge.
                    assert!(
                        matches!(operation.site, Site::Edge(x, y) if edge(x, y) == edge(a, b)),
                        "{:?} splits no seam",
                        operation.site
                    );
                }
            }
            assert_eq!(mesh.check(), Ok(()));
            // All of a chart's borders, and no others, are round the same triangles.
            let (of, now) = charts(&mesh, &edges);
            assert_eq!(now, count, "level {j}");
            let mut chart_of = vec![None; count];
            let mut seen = 0;
            for c in mesh.triangles().flat_map(|t| t.corners()) {
                let (a, b) = mesh.edge(c);
                if mesh.opposite(c).is_none() || edges.contains(&edge(a, b)) {
                    let chart = left[&(a, b)];
                    assert_eq!(*chart_of[of[c.triangle().index()]].get_or_insert(chart), chart, "level {j}");
                    seen += 1;
                }
            }
            assert_eq!(seen, left.len(), "every border is an edge at level {j}");
        }
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
        slid
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
    fn charts_stay_whole_at_every_level() {
        let meshes = [
            shapes::torus(24, 36),
            shapes::bumpy_sphere(4, 3),
            shapes::annulus(200),
            shapes::grid(20, 30),
            shapes::handle_body(3),
            shapes::torus_with_hole(20, 12),
            shapes::two_components(),
        ];
        let mut slid = 0;
        for (k, mesh) in (0..).zip(&meshes) {
            let table = table(mesh);
            for options in settings() {
                for count in [2, 7] {
                    let seams = cells(mesh, &table, count, 10 * k + u64::from(count));
                    let (table, done) = run(mesh, &seams, &options);
                    slid += check(&seams, &table, &done);
                }
                for one_in in [3, 30] {
                    let seams = scattered(&table, one_in, k);
                    let (table, done) = run(mesh, &seams, &options);
                    slid += check(&seams, &table, &done);
                }
            }
        }
        assert!(slid > 1000, "{slid} vertices have gone from curves");
    }

    /// Charts are whole as long as most of a level is free, and no longer: what stays is then as few as without charts.
    #[test]
    fn charts_are_given_up_where_they_lock_most() {
        let (mut kept, mut gone) = (0, 0);
        for mesh in [shapes::torus(24, 36), shapes::bumpy_sphere(4, 3), shapes::grid(20, 30)] {
            let table = table(&mesh);
            for options in [Options::default(), Options { method: Method::Ffc, ..Options::fine() }] {
                let options = Options { base_vertices: Some(40), ..options };
                for seams in
                    [cells(&mesh, &table, 2, 5), cells(&mesh, &table, 60, 5), scattered(&table, 3, 5)]
                {
                    let features = Features { seams: seams.clone(), ..Features::default() };
                    let (table, done) = run_with(&mesh, features, &options);
                    check(&seams, &table, &done);
                    let classes = classify(&table, &seams);
                    let corners = classes.iter().filter(|&&class| class == VertexClass::Corner).count();
                    // At each level with charts half of the vertices are free, but for the one that is given up.
                    let mut level = table.clone();
                    for j in 0..done.charts_to {
                        assert!(2 * corners <= vertices(&level).count(), "{corners} corners at level {j}");
                        done.history.undo_level(&mut level, j).unwrap();
                    }
                    let is_kept = done.charts_to == done.history.level_count();
                    assert!(vertices(&done.base).count() <= 40.max(if is_kept { 2 * corners } else { 0 }));
                    if is_kept { kept += 1 } else { gone += 1 }
                }
            }
        }
        assert!(kept >= 4 && gone >= 4, "{kept} kept, {gone} given up");
    }

    /// Closed curves have no corner, but each keeps three vertices: where nothing else is left and more are to go, they are given up.
    #[test]
    fn charts_are_given_up_where_nothing_else_goes() {
        let mesh = shapes::sphere(3);
        let table = table(&mesh);
        let zone = |t: Triangle| {
            (table.triangle(t).map(|v| mesh.positions[v.index()][2]).iter().sum::<f64>() * 0.8).floor()
        };
        let seams = bits(&table, |c| zone(c.triangle()) != zone(table.opposite(c).triangle()));
        let options = Options { base_vertices: Some(4), ..Options::default() };
        let (_, done) = run_with(
            &mesh,
            Features { seams: seams.clone(), binding: true, ..Features::default() },
            &options,
        );
        let left = vertices(&done.base).count();
        assert!(left >= 6 && done.charts_to == done.history.level_count(), "{left}");
        let (table, done) =
            run_with(&mesh, Features { seams: seams.clone(), ..Features::default() }, &options);
        check(&seams, &table, &done);
        assert_eq!(vertices(&done.base).count(), 4);
        assert!(done.charts_to > 0 && done.charts_to < done.history.level_count());
    }

    /// Where charts of two kinds are given up, those that must stay do.
    #[test]
    fn some_charts_are_kept_where_others_are_given_up() {
        for mesh in [shapes::torus(24, 36), shapes::bumpy_sphere(4, 3), shapes::grid(20, 30)] {
            let table = table(&mesh);
            for options in settings() {
                let kept = cells(&mesh, &table, 3, 5);
                let seams = kept.clone() | scattered(&table, 3, 5);
                let all = classify(&table, &seams).iter().filter(|&&c| c == VertexClass::Corner).count();
                let features = Features { seams: seams.clone(), kept: kept.clone(), ..Features::default() };
                let (_, mut done) = run_with(&mesh, features, &options);
                assert!(done.charts_to < done.history.level_count() && vertices(&done.base).count() < all);
                check(&seams, &table, &done);
                // All of its levels have those.
                done.charts_to = done.history.level_count();
                check(&kept, &table, &done);
            }
        }
    }

    /// The base of a mesh, no vertex of which need stay for its number.
    fn base(mesh: &IndexedMesh, seams: &BitVec) -> CornerTable {
        run(mesh, seams, &Options { base_vertices: Some(0), ..Options::default() }).1.base
    }

    /// Where every edge is a seam, every triangle is a chart, and the base is the mesh.
    #[test]
    fn where_every_edge_is_a_seam_all_stays() {
        // Vertices of all kinds: of three triangles, of two at the boundary, and of one, an ear.
        for mesh in [shapes::tetrahedron(), shapes::strip(9), shapes::disc_with_ears(), shapes::torus(8, 6)] {
            let seams = bits(&table(&mesh), |_| true);
            for options in settings() {
                let (table, done) = run(&mesh, &seams, &options);
                assert_eq!(done.base, table);
            }
        }
    }

    /// The equator of a sphere is a loop without a corner: three of its vertices stay, and a triangle on either side.
    #[test]
    fn a_closed_curve_keeps_three_vertices() {
        let mesh = shapes::sphere(3);
        let table = table(&mesh);
        let north =
            |t: Triangle| table.triangle(t).iter().map(|v| mesh.positions[v.index()][2]).sum::<f64>() > 0.0;
        let seams = bits(&table, |c| north(c.triangle()) != north(table.opposite(c).triangle()));
        assert!(seams.count_ones() > 60);
        let (table, done) = run(&mesh, &seams, &Options { base_vertices: Some(0), ..Options::default() });
        let on_curve = seams.count_ones() / 2;
        let gone = check(&seams, &table, &done);
        assert!(gone <= on_curve - 3 && gone >= on_curve - 6, "{gone} of {on_curve}");
    }

    /// A seam along the middle of a sheet ends inside it, or at its boundary: its ends stay, and what is between goes.
    #[test]
    fn ends_stay_wherever_they_are() {
        let mesh = shapes::grid(16, 8);
        let table = table(&mesh);
        let middle = |i: u32| Vertex(4 * 17 + i);
        for (from, to) in [(0, 16), (0, 10), (5, 10)] {
            let mut seams: BitVec = BitVec::repeat(false, 4 * table.slots());
            (from..to).for_each(|i| seams.set(table.find_edge(middle(i), middle(i + 1)).index(), true));
            let base = base(&mesh, &seams);
            assert!(base.has_edge(middle(from), middle(to)), "{from} to {to}");
        }
    }

    /// A corner of a sheet has one triangle, behind a seam: without the seam it goes.
    #[test]
    fn an_ear_behind_a_seam_stays() {
        let mesh = shapes::grid(6, 6);
        let table = table(&mesh);
        let ear = (0..49).map(Vertex).find(|&v| table.valence(v) == 2).unwrap();
        assert!(base(&mesh, &BitVec::new()).corner_of(ear).is_none());
        let mut seams: BitVec = BitVec::repeat(false, 4 * table.slots());
        seams.set(table.corner_of(ear).index(), true);
        assert!(base(&mesh, &seams).corner_of(ear).is_some());
    }

    /// On a plane everything goes for nothing but a seam's bends: it stays as near as the bends that are left allow.
    #[test]
    fn a_curve_stays_where_it_is() {
        // A square of two charts, whose border is a circle.
        let mut mesh = shapes::grid(40, 40);
        mesh.positions.iter_mut().for_each(|p| p[2] = 0.0);
        let table = table(&mesh);
        let inside = |t: Triangle| {
            let sum = table.triangle(t).map(|v| mesh.positions[v.index()]);
            let middle = [0, 1].map(|k| sum.iter().map(|p| p[k]).sum::<f64>() / 3.0 - 20.0);
            middle[0].hypot(middle[1]) < 14.0
        };
        let seams = bits(&table, |c| inside(c.triangle()) != inside(table.opposite(c).triangle()));
        let area = |table: &CornerTable, seams: &BTreeSet<_>| {
            let (of, count) = charts(table, seams);
            assert_eq!(count, 2);
            let mut areas = [0.0; 2];
            for t in table.triangles() {
                let [a, b, c] = table.triangle(t).map(|v| mesh.positions[v.index()]);
                areas[of[t.index()]] += 0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]));
            }
            areas[0].min(areas[1])
        };
        let before = edges(&table, &seams);
        let (table, done) = run(&mesh, &seams, &Options { base_vertices: Some(80), ..Options::default() });
        let mut after = before.clone();
        let mut level = table.clone();
        for operation in done.history.operations() {
            let v = operation.vertex;
            let at: Vec<_> = level.link(v).into_iter().filter(|&w| after.contains(&edge(v, w))).collect();
            if let [a, b] = at[..] {
                after.retain(|&(x, y)| x != v && y != v);
                after.insert(edge(a, b));
            }
            operation.undo(&mut level, done.history.flips(operation)).unwrap();
        }
        let (before_area, after_area) = (area(&table, &before), area(&level, &after));
        assert!((after_area / before_area - 1.0).abs() < 0.02, "{after_area} for {before_area}");
    }

    #[test]
    fn seams_are_those_of_the_table() {
        let mesh = shapes::torus(5, 4);
        let table = table(&mesh);
        let of = |seams| Seams::new(&table, seams, BitVec::new());
        assert!(of(BitVec::new()).unwrap().is_none());
        assert!(of(BitVec::repeat(false, 4 * table.slots())).unwrap().is_none());
        assert!(of(BitVec::repeat(true, 4 * table.slots())).unwrap().is_some());
        assert!(matches!(of(BitVec::repeat(true, 3 * table.slots())), Err(Error::Parameter(_))));
    }
}
