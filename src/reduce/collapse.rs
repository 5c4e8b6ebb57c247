//! Whether an edge may be contracted, and where its vertex goes.
//!
//! The link condition (Dey, Edelsbrunner, Guha, Nekhayev 1999) keeps the topology; the exception that shuts holes of three edges, and the
//! ball within which the optimum must lie, are of Chen, Fahn, Tsai, Chen, Lin (2006); that the optimum keeps the volume is of Lindstrom and
//! Turk (1998), who do not remember the input's planes either.

use super::quadric::{Form, Quadric};
use super::star::{Star, Wing};
use crate::mesh::distance::point_triangle_distance_squared;
use glam::DVec3;

/// What may become of the topology.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Topology {
    /// It stays: components, handles, loops of the boundary; vertices where the surface is no manifold stay in their places.
    #[default]
    Keep,
    /// As `Keep`, but holes of three edges are shut where a contraction comes to them.
    Close,
    /// Handles and holes may go. Two sheets may come to share an edge, as four triangles; edges of three triangles do not arise.
    Free,
}

/// What the checks and the placement of a contraction are.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rules {
    /// `None` where nothing is checked.
    pub(super) topology: Option<Topology>,
    /// Whether triangles may not turn over.
    pub(super) normals: bool,
    pub(super) placement: Placement,
}

/// Where the vertex of a contracted edge goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Placement {
    /// To the optimum, or else to the target (2004).
    Optimum,
    /// To the optimum, if it is within the ball over the edge, or else to the target (2006).
    Ball,
    /// To the optimum among the places that keep the volume (Lindstrom and Turk 1998), within that ball, or else to the best of source,
    /// target and their middle that turns no triangle over.
    ///
    /// Without it every pass pushes what is curved outwards, to where the planes of its triangles meet, and no later one knows of it.
    Best,
}

/// How far a contraction may go.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limits {
    /// What other places than the optimum may cost.
    pub(super) cost: f64,
    /// The square of how far source and target may lie off the triangles that are left of them.
    pub(super) reach: f64,
}

impl Limits {
    pub(super) const NONE: Self = Self { cost: f64::INFINITY, reach: f64::INFINITY };
}

/// The stars of source and target.
#[derive(Debug, Default)]
pub(super) struct Pair {
    pub(super) source: Star,
    pub(super) target: Star,
    /// Triangles that go, beside those at the edge, because they would repeat others.
    pub(super) repeated: Vec<u32>,
}

impl Pair {
    /// Whether the topology lets the edge be contracted; finds the triangles that would be repeated.
    pub(super) fn is_allowed(&mut self, topology: Option<Topology>) -> bool {
        self.repeated.clear();
        match topology {
            None => self.at_edge().next().is_some(),
            Some(Topology::Free) => self.is_free(),
            Some(kept) => self.keeps_link(kept == Topology::Close),
        }
    }

    /// The triangles at the edge.
    pub(super) fn at_edge(&self) -> impl Iterator<Item = &Wing> {
        let target = self.target.vertex;
        self.source.wings.iter().filter(move |wing| wing.a == target || wing.b == target)
    }

    /// The triangles of the source that stay.
    pub(super) fn moved(&self) -> impl Iterator<Item = &Wing> {
        self.source.wings.iter().filter(|wing| wing.a != self.target.vertex && wing.b != self.target.vertex)
    }

    /// The triangles of the target that stay.
    pub(super) fn beside(&self) -> impl Iterator<Item = &Wing> {
        self.target.wings.iter().filter(|wing| wing.a != self.source.vertex && wing.b != self.source.vertex)
    }

    /// The vertices that both have an edge to, each with the number of triangles at the edge of source and target.
    fn common(&self) -> impl Iterator<Item = (u32, u32, u32)> {
        let mut theirs = self.target.neighbours.iter().peekable();
        self.source.neighbours.iter().filter_map(move |n| {
            while theirs.next_if(|other| other.vertex < n.vertex).is_some() {}
            let other = theirs.next_if(|other| other.vertex == n.vertex)?;
            Some((n.vertex, n.triangles, other.triangles))
        })
    }

    fn keeps_link(&self, closes: bool) -> bool {
        let mut opposite = [u32::MAX; 2];
        let mut count = 0;
        for wing in self.at_edge() {
            let Some(place) = opposite.get_mut(count) else { return false };
            *place = if wing.a == self.target.vertex { wing.b } else { wing.a };
            count += 1;
        }
        let is_boundary = count == 1;
        if count == 0 || opposite[0] == opposite[1] {
            return false;
        }
        // Within, an edge between two vertices of the boundary would pinch; and the boundary moves along itself alone.
        if !is_boundary && self.source.is_boundary() {
            return false;
        }
        let mut third = None;
        for (vertex, at_source, at_target) in self.common() {
            let ends_both = at_source == 1 && at_target == 1;
            if opposite[..count].contains(&vertex) {
                // A triangle alone.
                if is_boundary && ends_both {
                    return false;
                }
            } else if closes && is_boundary && ends_both && third.is_none() {
                third = Some(vertex);
            } else {
                return false;
            }
        }
        // The last two triangles of a tetrahedron, or of one without a side.
        let corners = [opposite[0], if is_boundary { third.unwrap_or(u32::MAX) } else { opposite[1] }];
        let spans = |wing: &Wing| corners == [wing.a, wing.b] || corners == [wing.b, wing.a];
        !(self.moved().any(spans) && self.beside().any(spans))
    }

    /// Triangles that would be repeated go: both, if they lie against each other, or else one. An edge of more than two triangles has an
    /// even number or none more than before.
    fn is_free(&mut self) -> bool {
        if self.at_edge().next().is_none() {
            return false;
        }
        let mut repeated = std::mem::take(&mut self.repeated);
        if self.common().nth(1).is_some() {
            for wing in self.moved() {
                let alike = |other: &&Wing| {
                    [other.a, other.b] == [wing.a, wing.b] || [other.b, other.a] == [wing.a, wing.b]
                };
                if let Some(other) =
                    self.beside().filter(|other| !repeated.contains(&other.triangle)).find(alike)
                {
                    repeated.push(wing.triangle);
                    if other.a != wing.a {
                        repeated.push(other.triangle);
                    }
                }
            }
        }
        let stays = |wing: &&Wing| !repeated.contains(&wing.triangle);
        let fits = self.common().all(|(vertex, at_source, at_target)| {
            let has = |wing: &&Wing| wing.a == vertex || wing.b == vertex;
            let after = self.moved().chain(self.beside()).filter(stays).filter(has).count() as u32;
            after <= 2 || after.is_multiple_of(2) || after <= at_source.max(at_target)
        });
        self.repeated = repeated;
        fits
    }

    /// Whether no triangle turns over, or nearly so, with the vertex there. What has no area has no side.
    pub(super) fn is_clear(&self, at: DVec3) -> bool {
        self.moved().chain(self.beside()).all(|wing| {
            let cross = (wing.at_a - at).cross(wing.at_b - at);
            let (before, product) = (wing.cross.length_squared(), cross.dot(wing.cross));
            let bound = LEAST_COSINE * LEAST_COSINE * before * cross.length_squared();
            before == 0.0 || (product > 0.0 && product * product >= bound)
        })
    }

    /// Whether both ends are so near to the triangles with the vertex there. Planes do not tell: those of a spike all go along it, so that
    /// its tip may go far down at next to no cost.
    fn is_near(&self, at: DVec3, reach: f64) -> bool {
        let near =
            |end: DVec3, wing: &Wing| point_triangle_distance_squared(end, at, wing.at_a, wing.at_b) <= reach;
        let [source, target] = [DVec3::ZERO, self.target.at];
        // Mostly an end is near to what its own triangles become.
        let is_near_source = || {
            source.distance_squared(at) <= reach
                || self.moved().any(|wing| near(source, wing))
                || self.beside().any(|wing| near(source, wing))
        };
        let is_near_target = || {
            target.distance_squared(at) <= reach
                || self.beside().any(|wing| near(target, wing))
                || self.moved().any(|wing| near(target, wing))
        };
        reach.is_infinite() || is_near_source() && is_near_target()
    }

    /// The plane of the places where the vertex leaves the volume within the surface as it is: a normal, and its product with each of them.
    ///
    /// Six times the tetrahedron of a triangle and the vertex is the product of the triangle's cross with the way there from one of its
    /// corners; that of the source's triangles is the origin.
    fn volume(&self) -> (DVec3, f64) {
        let beside: DVec3 = self.beside().map(|wing| wing.cross).sum();
        let around: DVec3 = self.source.wings.iter().map(|wing| wing.cross).sum();
        (around + beside, beside.dot(self.target.at))
    }

    /// The place of the vertex, relative to the origin of both stars, which is where the source is; `None` where there is none. `extra` is
    /// what the place costs beside the planes.
    ///
    /// The limits are for [`Placement::Best`].
    pub(super) fn place(
        &self,
        forms: [Form; 2],
        extra: &Quadric,
        is_fixed: bool,
        rules: &Rules,
        limits: Limits,
    ) -> Option<DVec3> {
        let target = self.target.at;
        let clear = |at: &DVec3| !rules.normals || self.is_clear(*at) && self.is_near(*at, limits.reach);
        if is_fixed {
            return Some(target).filter(clear);
        }
        let [source_form, target_form] = forms;
        let mut sum = *extra;
        sum += Quadric::through(source_form, DVec3::ZERO);
        sum += Quadric::through(target_form, target);
        let optimum = match rules.placement {
            Placement::Best => {
                let (slope, level) = self.volume();
                sum.optimum_where(slope, level, SINGULAR)
            }
            Placement::Optimum | Placement::Ball => sum.optimum(DVec3::ZERO, SINGULAR),
        };
        let optimum = optimum.filter(|at| at.is_finite());
        // By Thales: both ends are seen at an obtuse angle.
        let within = |at: &DVec3| at.dot(*at - target) < 0.0;
        match rules.placement {
            Placement::Optimum => Some(optimum.unwrap_or(target)).filter(clear),
            Placement::Ball => Some(optimum.filter(within).unwrap_or(target)).filter(clear),
            Placement::Best => {
                if let Some(at) = optimum.filter(within).filter(clear) {
                    return Some(at);
                }
                let cost = |at: DVec3| source_form.at(at) + target_form.at(at - target) + extra.at(at);
                let mut places = [DVec3::ZERO, target, target / 2.0].map(|at| (cost(at), at));
                places.sort_by(|a, b| a.0.total_cmp(&b.0));
                places.into_iter().filter(|(cost, _)| *cost <= limits.cost).map(|(_, at)| at).find(clear)
            }
        }
    }
}

/// Where the cosine of the angle between a triangle's normals before and after is below this, it turns too far.
const LEAST_COSINE: f64 = 0.2;
/// A determinant below this part of the cube of a third of the trace is none.
pub(super) const SINGULAR: f64 = 1e-6;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{IndexedMesh, shapes};
    use crate::reduce::quadric::Weights;

    fn pair(mesh: &IndexedMesh, source: u32, target: u32) -> Pair {
        let mut pair = Pair::default();
        let ring: Vec<u32> = (0..mesh.triangles.len() as u32).collect();
        let origin = mesh.positions[source as usize];
        pair.source.gather(source, &ring, &mesh.triangles, &mesh.positions, origin);
        pair.target.gather(target, &ring, &mesh.triangles, &mesh.positions, origin);
        pair
    }

    fn allowed(mesh: &IndexedMesh, source: u32, target: u32) -> [bool; 3] {
        [Topology::Keep, Topology::Close, Topology::Free]
            .map(|topology| pair(mesh, source, target).is_allowed(Some(topology)))
    }

    #[test]
    fn a_tetrahedron_stays_unless_topology_is_free() {
        let mesh = shapes::tetrahedron();
        assert_eq!(allowed(&mesh, 0, 1), [false, false, true]);
        // Free, its last two triangles lie against each other: all four go.
        let mut all = pair(&mesh, 0, 1);
        assert!(all.is_allowed(Some(Topology::Free)));
        assert_eq!((all.at_edge().count(), all.repeated.len()), (2, 2));
        assert_eq!(
            allowed(&IndexedMesh::new(mesh.positions.clone(), mesh.triangles[..1].to_vec()), 0, 1),
            [false, false, true]
        );
    }

    #[test]
    fn the_boundary_moves_along_itself() {
        let mesh = shapes::disc_with_ears();
        // From within to the boundary; not from there inwards; along it; across an ear's base, which would pinch.
        assert!(allowed(&mesh, 0, 1)[0]);
        assert!(!allowed(&mesh, 1, 0)[0]);
        assert!(allowed(&mesh, 7, 1)[0]);
        assert!(!allowed(&mesh, 1, 2)[0]);
        // No edge at all.
        assert_eq!(allowed(&mesh, 0, 7), [false; 3]);
    }

    #[test]
    fn a_neck_of_three_edges_is_kept_or_pinched() {
        // A tube of three sides, long enough that its rings are no triangles.
        let positions =
            (0..12).map(|i| [f64::from(i % 3).cos(), f64::from(i % 3).sin(), f64::from(i / 3)]).collect();
        let square = |i: u32, j: u32| {
            let [a, b] = [3 * j + i, 3 * j + (i + 1) % 3];
            [[a, b, b + 3], [a, b + 3, a + 3]]
        };
        let tube = (0..3).flat_map(|j| (0..3).flat_map(move |i| square(i, j))).collect();
        let mesh = IndexedMesh::new(positions, tube);
        assert_eq!(allowed(&mesh, 3, 4), [false, false, true]);
        // At its end it is a hole of three edges.
        assert_eq!(allowed(&mesh, 0, 1), [false, true, true]);
    }

    #[test]
    fn triangles_do_not_turn_over() {
        let mesh = shapes::disc_with_ears();
        let pair = pair(&mesh, 0, 1);
        assert!(pair.is_clear(DVec3::ZERO), "as it is");
        assert!(pair.is_clear(pair.target.at), "at the target");
        assert!(!pair.is_clear(pair.target.at * -5.0), "over an edge on the other side");
    }

    #[test]
    fn the_best_place_keeps_the_volume() {
        let mesh = shapes::bumpy_sphere(3, 4);
        let volume = |mesh: &IndexedMesh| -> f64 {
            let of = |t: &[u32; 3]| {
                let [a, b, c] = t.map(|v| DVec3::from(mesh.positions[v as usize]));
                a.cross(b).dot(c) / 6.0
            };
            mesh.triangles.iter().map(of).sum()
        };
        let [source, target] = [mesh.triangles[100][0], mesh.triangles[100][1]];
        let pair = pair(&mesh, source, target);
        let forms = [&pair.source, &pair.target].map(|star| star.form(Weights::Area, true));
        let after = |placement| {
            let rules = Rules { topology: None, normals: true, placement };
            let place = pair.place(forms, &Quadric::default(), false, &rules, Limits::NONE).unwrap();
            let at = (place + DVec3::from(mesh.positions[source as usize])).to_array();
            let mut moved = mesh.clone();
            [source, target].into_iter().for_each(|v| moved.positions[v as usize] = at);
            volume(&moved) - volume(&mesh)
        };
        let (best, ball) = (after(Placement::Best), after(Placement::Ball));
        assert!(best.abs() < 1e-12 && ball.abs() > 1e-7, "{best} {ball}");
    }

    #[test]
    fn the_places() {
        let mesh = shapes::disc_with_ears();
        let pair = pair(&mesh, 0, 1);
        let rules = |placement| Rules { topology: None, normals: true, placement };
        let planes = |normals: &[DVec3]| {
            let mut form = Form::default();
            normals.iter().for_each(|&n| form.add_triangle(n, super::super::quadric::Weights::Unit));
            form
        };
        let all = planes(&[DVec3::X, DVec3::Y, DVec3::Z]);
        let places = [Placement::Optimum, Placement::Ball, Placement::Best];
        // Equal forms, round in all directions: the middle, or what of the plane that keeps the volume is nearest to it.
        let middle = pair.target.at / 2.0;
        let (slope, level) = pair.volume();
        let nearest = middle + slope * ((level - slope.dot(middle)) / slope.length_squared());
        for (placement, expected) in places.into_iter().zip([middle, middle, nearest]) {
            let place =
                pair.place([all; 2], &Quadric::default(), false, &rules(placement), Limits::NONE).unwrap();
            assert!((place - expected).length() < 1e-12);
            assert_eq!(
                pair.place([all; 2], &Quadric::default(), true, &rules(placement), Limits::NONE),
                Some(pair.target.at)
            );
        }
        // No optimum: the target, or where it costs least, at the source, whose planes are the only ones.
        let none = Form::default();
        let place = places.map(|placement| {
            let forms = [planes(&[DVec3::X]), none];
            pair.place(forms, &Quadric::default(), false, &rules(placement), Limits::NONE).unwrap()
        });
        assert_eq!(place, [pair.target.at, pair.target.at, DVec3::ZERO]);
    }
}
