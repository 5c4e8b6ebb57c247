//! Chapters 2 and 4: a mesh, its root edges, and the order of its triangles, edges and vertices.

use std::collections::{BTreeMap, BTreeSet};

/// A directed edge a→b. It stands for the corner behind it as well, which faces it (§2.1).
pub type Edge = (usize, usize);

/// A manifold mesh.
#[derive(Default)]
pub struct Mesh {
    /// For each directed edge with a triangle on its left, the third vertex of that triangle.
    pub third: BTreeMap<Edge, usize>,
    /// Lattice points of the vertices.
    pub points: Vec<[i64; 3]>,
    /// Components of the vertices.
    pub component: Vec<usize>,
    /// Root edges of the components.
    pub roots: Vec<Edge>,
}

impl Mesh {
    /// V[c] of the corner behind an edge.
    pub fn tip(&self, c: Edge) -> usize {
        self.third[&c]
    }

    pub fn next(&self, c: Edge) -> Edge {
        (c.1, self.tip(c))
    }

    pub fn prev(&self, c: Edge) -> Edge {
        (self.tip(c), c.0)
    }

    /// O[c].
    pub fn opposite(&self, c: Edge) -> Option<Edge> {
        let o = (c.1, c.0);
        self.third.contains_key(&o).then_some(o)
    }

    /// The triangle of a corner, (V[c], V[next(c)], V[prev(c)]).
    pub fn triangle(&self, c: Edge) -> [usize; 3] {
        [self.tip(c), c.0, c.1]
    }

    pub fn add(&mut self, [x, y, z]: [usize; 3]) {
        for (edge, third) in [((x, y), z), ((y, z), x), ((z, x), y)] {
            assert!(self.third.insert(edge, third).is_none(), "an edge has one triangle on its left");
        }
    }

    pub fn remove(&mut self, [x, y, z]: [usize; 3]) {
        for (edge, third) in [((x, y), z), ((y, z), x), ((z, x), y)] {
            assert_eq!(self.third.remove(&edge), Some(third));
        }
    }

    /// All triangles, each once, from its smallest vertex.
    pub fn triangles(&self) -> impl Iterator<Item = [usize; 3]> + '_ {
        self.third.iter().filter(|&(&(a, b), &c)| a < b && a < c).map(|(&(a, b), &c)| [a, b, c])
    }

    /// §4.1: what becomes of the root edge once v has been inserted and those edges destroyed.
    pub fn mend_root(&mut self, v: usize, destroyed: &[Edge]) {
        let root = &mut self.roots[self.component[v]];
        let (u, w) = *root;
        if destroyed.contains(&(u, w)) || destroyed.contains(&(w, u)) {
            *root = if self.third.contains_key(&(u, v)) { (u, v) } else { (v, u) };
        }
    }
}

/// §4.2: corners, each standing for its triangle or for the edge it faces.
pub struct Walk {
    pub triangles: Vec<Edge>,
    pub edges: Vec<Edge>,
}

impl Walk {
    pub fn of(mesh: &Mesh) -> Self {
        let (mut edges, mut triangles) = (Vec::new(), Vec::new());
        // By rule 4 a triangle is told by the set of its vertices.
        let name = |c| {
            let mut triangle = mesh.triangle(c);
            triangle.sort_unstable();
            triangle
        };
        let mut visited = BTreeSet::new();
        for &r in &mesh.roots {
            let mut head = edges.len();
            triangles.push(r);
            visited.insert(name(r));
            edges.extend([r, mesh.next(r), mesh.prev(r)]);
            while head < edges.len() {
                let reached = mesh.opposite(edges[head]);
                head += 1;
                let Some(c) = reached else { continue };
                if !visited.insert(name(c)) {
                    continue;
                }
                triangles.push(c);
                for d in [mesh.next(c), mesh.prev(c)] {
                    if mesh.opposite(d).is_none_or(|o| !visited.contains(&name(o))) {
                        edges.push(d);
                    }
                }
            }
        }
        Self { triangles, edges }
    }

    /// The boundary edges, in order.
    pub fn boundary(&self, mesh: &Mesh) -> Vec<Edge> {
        self.edges.iter().copied().filter(|&k| mesh.opposite(k).is_none()).collect()
    }

    /// The vertices, in order.
    pub fn vertices(&self, mesh: &Mesh) -> Vec<usize> {
        let mut seen = BTreeSet::new();
        // V[next(c)] and V[prev(c)] are the ends of the edge that c faces.
        let met = self.triangles.iter().flat_map(|&c| [c.0, c.1, mesh.tip(c)]);
        met.filter(|&v| seen.insert(v)).collect()
    }
}

#[test]
fn the_example_of_the_chapter() {
    let [a, b, c, d] = [0, 1, 2, 3];
    let mut mesh = Mesh { roots: vec![(a, b)], ..Mesh::default() };
    mesh.add([a, b, c]);
    mesh.add([a, c, d]);
    let walk = Walk::of(&mesh);
    assert_eq!(walk.triangles, [(a, b), (a, c)]);
    assert_eq!(walk.edges, [(a, b), (b, c), (c, a), (c, d), (d, a)]);
    assert_eq!(walk.boundary(&mesh), [(a, b), (b, c), (c, d), (d, a)]);
    assert_eq!(walk.vertices(&mesh), [a, b, c, d]);
}
