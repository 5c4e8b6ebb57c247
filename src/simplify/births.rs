//! Components that coarse levels lack: a small part is to appear when it is worth a pixel, and not before.
//!
//! Where a level is as far from the input as a component is large, nobody misses it in the next coarser one; so it is left out there, and
//! born at the level. Where that leaves too many, since no vertex of what is left can go, the smallest ones are left out anyway.

use super::frame::Places;
use super::removal::{Remover, vertices};
use crate::mesh::{CornerTable, Triangle, Vertex};
use crate::refine::Birth;
use glam::DVec3;

/// Which components coarse levels may lack. The largest one is at all levels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Births {
    /// None.
    #[default]
    None,
    /// Those without a boundary.
    Closed,
    /// All.
    All,
}

/// The components of the input, those that levels still have but may lose in line.
#[derive(Debug)]
pub struct Components {
    /// The component of each vertex; empty where none can go.
    of: Vec<u32>,
    /// Of each component, the squared diagonal of its bounding box, in the unit cube.
    sizes: Vec<f64>,
    /// Where each is along a curve that fills the cube.
    keys: Vec<u32>,
    /// Those that may go, the next one last.
    line: Vec<u32>,
}

/// What a level may lack beyond what the level before lacks.
#[derive(Clone, Copy, Debug)]
pub struct Lack {
    /// Components up to this squared diagonal.
    pub size: f64,
    /// Triangles; one component may have more.
    pub triangles: usize,
    /// No further one once so many vertices are gone.
    pub vertices: usize,
}

impl Components {
    /// Those of a mesh.
    pub fn new(table: &CornerTable, places: &Places, births: Births) -> Self {
        let mut this = Self { of: Vec::new(), sizes: Vec::new(), keys: Vec::new(), line: Vec::new() };
        if births == Births::None {
            return this;
        }
        let mut open = Vec::new();
        this.of.resize(table.vertex_slots(), NONE);
        let mut queue = Vec::new();
        for v in vertices(table) {
            if this.of[v.index()] != NONE {
                continue;
            }
            let number = this.sizes.len() as u32;
            let (mut low, mut high, mut is_open) = (places.at(v), places.at(v), false);
            this.of[v.index()] = number;
            queue.push(v);
            while let Some(v) = queue.pop() {
                (low, high) = (low.min(places.at(v)), high.max(places.at(v)));
                is_open |= table.is_boundary(v);
                for w in table.vertices_round(v) {
                    if this.of[w.index()] == NONE {
                        this.of[w.index()] = number;
                        queue.push(w);
                    }
                }
            }
            this.sizes.push((high - low).length_squared());
            this.keys.push(key(0.5 * (low + high)));
            open.push(is_open);
        }
        // Of several that are equally large, those go that chance picks, so that the others are everywhere.
        let chance = |k: u32| k.wrapping_mul(0x9e37_79b1);
        let mut line: Vec<_> = (0..this.sizes.len() as u32).collect();
        line.sort_by(|&k, &l| {
            let size = |k: u32| this.sizes[k as usize];
            size(l).total_cmp(&size(k)).then(chance(k).cmp(&chance(l)))
        });
        line = line.into_iter().skip(1).filter(|&k| births == Births::All || !open[k as usize]).collect();
        if line.is_empty() {
            this.of = Vec::new();
        }
        this.line = line;
        this
    }

    /// The squared diagonal of the smallest component that may still go.
    pub fn smallest(&self) -> Option<f64> {
        self.line.last().map(|&k| self.sizes[k as usize])
    }

    /// Leaves out what may be lacking from the next coarser level on, the smallest first. Returns how many triangles that are.
    pub fn leave(&mut self, remover: &mut Remover, may: Lack) -> usize {
        if self.smallest().is_none_or(|size| size > may.size) {
            return 0;
        }
        let mut counts = vec![[0usize; 2]; self.sizes.len()];
        for t in remover.table.triangles() {
            counts[self.of[remover.table.triangle(t)[0].index()] as usize][0] += 1;
        }
        for v in vertices(&remover.table) {
            counts[self.of[v.index()] as usize][1] += 1;
        }
        let mut goes = vec![false; self.sizes.len()];
        let [mut triangles, mut gone] = [0; 2];
        while let Some(&k) = self.line.last() {
            let [t, v] = counts[k as usize];
            let too_much = triangles > 0 && triangles + t > may.triangles;
            if self.sizes[k as usize] > may.size || gone >= may.vertices || too_much {
                break;
            }
            (triangles, gone) = (triangles + t, gone + v);
            goes[k as usize] = true;
            self.line.pop();
        }
        self.take(remover, &goes);
        triangles
    }

    /// Takes components out; neighbours will stand next to each other.
    fn take(&self, remover: &mut Remover, goes: &[bool]) {
        let component = |v: Vertex| self.of[v.index()];
        let of_triangle = |t: Triangle| component(remover.table.triangle(t)[0]);
        let mut going: Vec<_> = remover
            .table
            .triangles()
            .map(|t| (of_triangle(t), t))
            .filter(|&(k, _)| goes[k as usize])
            .map(|(k, t)| (self.keys[k as usize], k, t))
            .collect();
        going.sort_unstable();
        let going: Vec<_> = going.into_iter().map(|(.., t)| t).collect();
        let mut covered = Vec::new();
        going.iter().for_each(|&t| remover.covering.take(t, &mut covered));
        let birth = Birth::take(&mut remover.table, &going);
        remover.vertices -= birth.vertices.len();
        for v in covered.into_iter().chain(birth.vertices.iter().copied()) {
            remover.covering.miss(v, self.sizes[component(v) as usize]);
        }
        remover.history.bear(birth);
    }
}

/// Where a point of the unit cube is along a curve that fills it: the bits of its coordinates by turns.
fn key(p: DVec3) -> u32 {
    let spread = |x: f64| {
        let cell = (x * 1024.0).clamp(0.0, 1023.0) as u32;
        (0..10).fold(0, |key, bit| key | (cell >> bit & 1) << (3 * bit))
    };
    spread(p.x) | spread(p.y) << 1 | spread(p.z) << 2
}

const NONE: u32 = u32::MAX;

#[cfg(test)]
mod tests {
    use super::super::{Features, Options, Simplified, simplify};
    use super::*;
    use crate::mesh::{IndexedMesh, Lattice, lattice, shapes};
    use bitvec::bitvec;

    /// Spheres in a row, each half as large as the one before, and loose triangles.
    fn parts() -> IndexedMesh {
        let mut mesh = IndexedMesh::default();
        let mut add = |part: &IndexedMesh, size: f64, at: [f64; 3]| {
            let first = mesh.positions.len() as u32;
            let place = |p: &[f64; 3]| [0, 1, 2].map(|k| at[k] + size * p[k]);
            mesh.positions.extend(part.positions.iter().map(place));
            mesh.triangles.extend(part.triangles.iter().map(|t| t.map(|v| v + first)));
        };
        let ball = shapes::bumpy_sphere(3, 1);
        for k in 0..8 {
            add(&ball, 0.5f64.powi(k), [3.0 * f64::from(k), 0.0, 0.0]);
        }
        let sheet = shapes::grid(1, 1);
        for k in 0..60 {
            add(&sheet, 0.02 + 0.001 * f64::from(k), [0.4 * f64::from(k), 2.0, f64::from(k % 7)]);
        }
        mesh
    }

    fn simplified(mesh: &IndexedMesh, births: Births) -> (CornerTable, Simplified) {
        let table = CornerTable::from_triangles(mesh.positions.len(), &mesh.triangles).unwrap();
        let (min, max) = lattice::bounds(mesh.positions.iter().copied()).unwrap();
        let options = Options { births, ..Options::default() };
        let done = simplify(
            table.clone(),
            &mesh.positions,
            bitvec![0; mesh.positions.len()],
            Features::default(),
            &Lattice::over(min, max, 14),
            &options,
            &mut |_, _| true,
        );
        (table, done.unwrap())
    }

    fn diagonal(mesh: &IndexedMesh, vertices: &[Vertex]) -> f64 {
        let (min, max) = lattice::bounds(vertices.iter().map(|v| mesh.positions[v.index()])).unwrap();
        DVec3::from_array(min).distance(DVec3::from_array(max))
    }

    /// Each component is missing only where the level's error says so, and all come back.
    #[test]
    fn small_components_are_born_late() {
        let mesh = parts();
        let (mut table, done) = simplified(&mesh, Births::All);
        let input = table.clone();
        let mut births = 0;
        for j in 0..done.history.level_count() {
            let before = table.triangle_count();
            if let Some(birth) = done.history.birth(j) {
                births += 1;
                for of in components(birth) {
                    // What is left of it is no larger than it was.
                    assert!(diagonal(&mesh, &of) <= done.errors[j + 1].max);
                }
            }
            done.history.undo_level(&mut table, j).unwrap();
            assert_eq!(table.check(), Ok(()));
            assert!(2 * table.triangle_count() >= before, "{before} to {}", table.triangle_count());
            assert!(done.errors[j + 1].max >= done.errors[j].max);
        }
        assert!(births > 2);
        assert_eq!(table.triangle_count(), done.base.triangle_count());
        assert!(table.triangle_count() < 400);
        for j in (0..done.history.level_count()).rev() {
            done.history.apply_level(&mut table, j).unwrap();
        }
        assert_eq!(table.triangle_count(), input.triangle_count());
        assert_eq!(table.check(), Ok(()));
    }

    /// The vertices of each component.
    fn components(birth: &Birth) -> Vec<Vec<Vertex>> {
        let mut of: Vec<usize> = (0..birth.vertices.len()).collect();
        let mut changes = true;
        while changes {
            changes = false;
            for t in birth.table.triangles() {
                let corners = birth.table.triangle(t).map(Vertex::index);
                let least = corners.map(|v| of[v]).into_iter().min().unwrap();
                for v in corners {
                    changes |= std::mem::replace(&mut of[v], least) != least;
                }
            }
        }
        let with = |k: usize| (0..of.len()).filter(|&v| of[v] == k).map(|v| birth.vertices[v]).collect();
        (0..of.len()).filter(|&k| of[k] == k).map(with).collect()
    }

    #[test]
    fn what_may_not_go_stays() {
        let mesh = parts();
        let (_, closed) = simplified(&mesh, Births::Closed);
        let (_, none) = simplified(&mesh, Births::None);
        // Each of the sheets has at least its last triangle.
        let open = |table: &CornerTable| vertices(table).filter(|&v| table.is_boundary(v)).count();
        assert!(open(&closed.base) >= 60 * 3);
        assert!(open(&none.base) >= 60 * 3);
        assert!(none.history.birth(0).is_none() && none.base.triangle_count() > closed.base.triangle_count());
    }
}
