//! What a writer knows corners by, on the way from the finest mesh to the base.

mod parting;

use super::{Site, wedges};
use crate::mesh::{Corner, CornerTable, Triangle, Vertex};

pub use parting::{Parting, Taken};

/// A label for each corner, and one for each triangle, of a mesh that loses its vertices.
///
/// When a vertex goes, each coarse corner takes the label of a fine one at the same vertex and in the same part of the star, as on the same
/// side of the edge that is left: what [`Wedges::carry`](super::Wedges::carry) makes of coarse corners is then what the fine ones were, but
/// for link vertices that were of two labels there. Where a vertex goes onto another one that is not in each of its parts, what is left of
/// these has the vertex's own label there.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Labels {
    /// By slot and place; the fourth is the triangle's.
    corners: Vec<[u32; 4]>,
}

/// The star of a vertex: what each of its triangles is labelled, and round which vertices it goes.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Ring {
    /// Of each triangle, counter-clockwise: at the vertex, at the next, at the one before; and its own.
    pub labels: Vec<[u32; 4]>,
    /// Its corners at the vertex.
    pub corners: Vec<Corner>,
    /// The next vertex of each of them, and at the boundary the last one.
    link: Vec<Vertex>,
}

impl Ring {
    /// The vertex of the link that it begins at.
    pub fn first(&self) -> Vertex {
        self.link.first().copied().unwrap_or(Vertex::NONE)
    }

    /// How the star is parted where its vertex was inserted at `site`: by the edge that is left, if one is.
    pub fn parting(&self, site: Site) -> Parting {
        let is_open = self.link.len() > self.labels.len();
        match site {
            Site::Edge(_, b) if !is_open => {
                let end = self.place(b).unwrap_or(0);
                Parting::onto(self.labels.len(), is_open, 0, 1 | 1 << end)
            }
            _ => Parting::none(self.labels.len(), is_open),
        }
    }

    /// How it is parted where its vertex has gone onto another one.
    pub fn parting_of(&self, slid: &Slid) -> Parting {
        let onto = self.place(slid.onto).unwrap_or(0);
        Parting::onto(self.labels.len(), self.link.len() > self.labels.len(), onto, slid.borders | 1 << onto)
    }

    fn place(&self, w: Vertex) -> Option<usize> {
        self.link.iter().position(|&other| other == w)
    }
}

/// A vertex that has gone onto one of its link, charts round it kept apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Slid {
    /// The vertex.
    pub vertex: Vertex,
    /// Where it went.
    pub onto: Vertex,
    /// The places of its [`Ring`]'s link where charts meet, a bit each.
    pub borders: u64,
}

impl Labels {
    /// Labels by slot: of the three corners, then of the triangle.
    pub fn new(corners: Vec<[u32; 4]>) -> Self {
        Self { corners }
    }

    /// The label of a corner.
    #[inline]
    pub fn of(&self, c: Corner) -> u32 {
        self.corners[c.triangle().index()][c.place()]
    }

    /// The label of a triangle.
    #[inline]
    pub fn of_triangle(&self, t: Triangle) -> u32 {
        self.corners[t.index()][3]
    }

    /// An operation has been carried out: labels its star. `labels` are those of the ring of its vertex.
    pub fn apply(&mut self, table: &CornerTable, ring: &[Corner], labels: &[[u32; 4]]) {
        self.corners.resize(table.slots(), [0; 4]);
        for (c, labels) in ring.iter().zip(labels) {
            let corners = &mut self.corners[c.triangle().index()];
            for (c, label) in [*c, c.next(), c.prev()].into_iter().zip(labels) {
                corners[c.place()] = *label;
            }
            corners[3] = labels[3];
        }
    }

    /// Those of components that join.
    pub fn append(&mut self, part: &Self) {
        self.corners.extend_from_slice(&part.corners);
    }

    /// Only those of triangles that are left, which have been numbered anew in their order.
    pub fn compact(&mut self, there: &[Triangle]) {
        for (k, t) in there.iter().enumerate() {
            self.corners[k] = self.corners[t.index()];
        }
        self.corners.truncate(there.len());
    }

    /// Reads the star of `v`, which was inserted at `site`.
    pub fn ring(&self, table: &CornerTable, v: Vertex, site: Site, ring: &mut Ring) {
        wedges::ring(table, v, site, &mut ring.corners);
        let corners = &ring.corners;
        let of =
            |&c: &Corner| [self.of(c), self.of(c.next()), self.of(c.prev()), self.of_triangle(c.triangle())];
        ring.labels.clear();
        ring.labels.extend(corners.iter().map(of));
        ring.link.clear();
        ring.link.extend(corners.iter().map(|c| table.vertex(c.next())));
        if let Some(last) = corners.last().filter(|_| table.is_boundary(v)) {
            ring.link.push(table.vertex(last.prev()));
        }
    }

    /// The vertex of `ring`, inserted at `site`, has gone from `table`: labels the corners of what is left of its triangles, a star parted by
    /// `parting`. `larger` says of two of its triangles whether the second is the larger one: its label stays where there are two for a
    /// corner.
    pub fn settle(
        &mut self,
        table: &CornerTable,
        ring: &Ring,
        site: Site,
        parting: Parting,
        larger: impl Fn(usize, usize) -> bool,
    ) {
        if let Site::Attach(..) = site {
            return;
        }
        let labels = &ring.labels;
        // The places of those that were last in the list are gone.
        let is_left = |t: Triangle| t.index() < table.slots() && table.is_live(t);
        for t in ring.corners.iter().map(|c| c.triangle()).filter(|t| is_left(*t)) {
            let [Some(a), Some(b), Some(c)] = table.triangle(t).map(|w| ring.place(w)) else { continue };
            let part = parting.part_of([a, b, c]);
            for (k, place) in [a, b, c].into_iter().enumerate() {
                self.corners[t.index()][k] = match parting.taken(part, place) {
                    Taken::Before(x) => labels[x][2],
                    Taken::Behind(y) => labels[y][1],
                    Taken::Either(x, y) if labels[x][2] != labels[y][1] && larger(x, y) => labels[y][1],
                    Taken::Either(x, _) => labels[x][2],
                    Taken::Own => labels[parting.largest(part, &larger)][0],
                };
            }
            self.corners[t.index()][3] = labels[parting.triangles_of(part).next().unwrap_or(0)][3];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes;
    use crate::refine::wedges::Carried;
    use crate::refine::{Operation, Wedges};

    /// Corners labelled by vertex and by which side of a plane their triangle is on, triangles by side; all vertices that can go by an edge
    /// go and come back: what is carried is what was there, on both sides of seams that run along the edges left.
    #[test]
    fn what_is_carried_is_what_was_there() {
        for mesh in [shapes::torus(8, 6), shapes::grid(6, 5), shapes::sphere(2)] {
            let table = CornerTable::from_triangles(mesh.positions.len(), &mesh.triangles).unwrap();
            let right = |t: Triangle| {
                table.triangle(t).iter().map(|v| mesh.positions[v.index()][0]).sum::<f64>() > 1.0
            };
            let of = |t: Triangle| {
                let side = u32::from(right(t));
                let [a, b, c] = table.triangle(t).map(|v| 2 * v.0 + side);
                [a, b, c, side]
            };
            let labels = Labels::new(table.triangles().map(of).collect());
            let mut gone = 0;
            for v in (0..mesh.positions.len() as u32).map(Vertex).filter(|&v| table.corner_of(v).is_some()) {
                let link = table.link(v);
                let seams: Vec<usize> = table
                    .fan(v)
                    .enumerate()
                    .filter(|(_, c)| {
                        let beyond = table.opposite(c.prev());
                        beyond.is_some() && right(c.triangle()) != right(beyond.triangle())
                    })
                    .map(|(place, _)| place)
                    .collect();
                let (i, k) = match (seams[..].len(), table.is_boundary(v)) {
                    (2, false) => (seams[0], seams[1]),
                    (0, false) => (0, 2),
                    (0, true) => (link.len() - 1, 0),
                    _ => continue,
                };
                let (a, b) = (link[i], link[k]);
                // Flips that leave the triangles of the split: fans from the other link vertices' edges to one of each side.
                for flips in candidates(&link, i, k, table.is_boundary(v)) {
                    let operation = Operation {
                        vertex: v,
                        site: Site::Edge(a, b),
                        first_flip: 0,
                        flip_count: flips.len() as u32,
                    };
                    let mut coarse = table.clone();
                    if operation.undo(&mut coarse, &flips).is_err() {
                        continue;
                    }
                    gone += 1;
                    let (mut below, mut ring) = (labels.clone(), Ring::default());
                    below.ring(&table, v, operation.site, &mut ring);
                    let parting = ring.parting(operation.site);
                    below.settle(&coarse, &ring, operation.site, parting, |_, _| panic!("no seam ends here"));
                    carried(&table, &mut coarse, &operation, &flips, &below, &labels);
                }
            }
            assert!(gone > 10, "{gone}");
        }
    }

    /// Lists of flips that may lead to a star with these neighbours from the split of the edge from the `i`-th to the `k`-th.
    fn candidates(link: &[Vertex], i: usize, k: usize, boundary: bool) -> Vec<Vec<Vertex>> {
        let count = link.len();
        let between = |from: usize, to: usize| {
            let mut places = Vec::new();
            let mut at = (from + 1) % count;
            while at != to {
                places.push(link[at]);
                at = (at + 1) % count;
            }
            places
        };
        let right = if boundary { Vec::new() } else { between(i, k) };
        let left = between(k, i);
        let fan = |start: Vertex, places: &[Vertex]| -> Vec<Vertex> {
            // The first wing is the last of the places: each flip's link edge starts where the side does.
            std::iter::repeat_n(start, places.len().saturating_sub(1)).collect()
        };
        vec![[fan(link[i], &right), fan(link[k], &left)].concat()]
    }

    fn carried(
        fine: &CornerTable,
        coarse: &mut CornerTable,
        operation: &Operation,
        flips: &[Vertex],
        below: &Labels,
        labels: &Labels,
    ) {
        let mut wedges = Wedges::of_labels(coarse, |c| below.of(c), |t| below.of_triangle(t));
        // As a reader carries it out, by hand.
        let Site::Edge(a, b) = operation.site else { panic!("an edge") };
        let k = coarse.find_directed_edge(a, b);
        let (corners, count) = crate::refine::stellar::split_edge(coarse, k, operation.vertex);
        let [new_left, old_left, new_right, old_right] = corners;
        let mut star = if count == 4 {
            vec![new_left, new_right, old_left, old_right]
        } else {
            vec![new_left, old_left]
        };
        let mut flipped = Vec::new();
        for &p in flips {
            let c = coarse.fan(operation.vertex).find(|&c| coarse.vertex(c.next()) == p).unwrap();
            flipped.push(c);
            star.push(crate::refine::stellar::flip(coarse, c));
        }
        let created = count / 2;
        wedges.carry(coarse, &Carried { site: operation.site, star: &star, created, flips: &flipped });
        // The same triangles, in other places.
        for t in fine.triangles() {
            let vertices = fine.triangle(t);
            let c = coarse.find_directed_edge(vertices[0], vertices[1]).next();
            assert_eq!(coarse.vertex(c.prev()), vertices[2]);
            assert_eq!(wedges.row(c.triangle()), labels.of_triangle(t));
            for (place, c) in [c, c.next(), c.prev()].into_iter().enumerate() {
                let known = t.corner(place as u32);
                let wanted =
                    if vertices[place] == operation.vertex { Wedges::NONE } else { labels.of(known) };
                assert_eq!(wedges.of(c), wanted, "{operation:?} at {:?}", vertices[place]);
            }
        }
    }
}
