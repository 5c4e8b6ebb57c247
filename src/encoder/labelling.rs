//! What corners are labelled at every level: the truth that attributes are coded by.

use crate::codec::attributes::Truth;
use crate::mesh::attributes::{Domain, Kind};
use crate::mesh::topology::Remainder;
use crate::mesh::{Corner, CornerTable, IndexedMesh, Triangle, Vertex};
use crate::refine::labels::{Parting, Slid};
use crate::refine::{Birth, History, Labels, Operation, Ring, Site, wedges};

/// The labels of the base, of what is born at levels, and round the vertex of each operation.
#[derive(Debug)]
pub struct Labelling {
    /// What labels stand for.
    pub truth: Truth,
    /// By triangle of the input: the labels of its corners, and its own.
    pub of_input: Vec<[u32; 4]>,
    /// The base's, the places of its removed triangles taken out.
    pub base: Labels,
    /// For each column of triangles the coarsest level that can have it: every operation of finer ones leaves triangles with the values
    /// of those that they come from. For columns at corners the base.
    pub coarsest: Vec<usize>,
    /// For each column which share of the input's edges between two triangles parts it.
    pub parted: Vec<f64>,
    /// For each level those of the components that are born there, by slot of their own table.
    births: Vec<Labels>,
    /// By vertex where its ring begins: in the list, and at which vertex of its link.
    first: Vec<(u32, Vertex)>,
    rings: Vec<[u32; 4]>,
}

impl Labelling {
    /// Labels the corners of `table`, made of the triangles of `mesh` that `remainder` says, and follows them through its history;
    /// `positions` are those of its vertices, `slid` the vertices that went onto others, in the order of the history.
    pub fn new(
        mesh: &IndexedMesh,
        kinds: &[Kind],
        remainder: &Remainder,
        mut table: CornerTable,
        history: &History,
        slid: &[Slid],
        positions: &[[i32; 3]],
    ) -> Self {
        let (truth, of_input) = Truth::new(&mesh.attributes, kinds, mesh.triangles.len());
        let of_table = remainder.origins.in_table.iter_ones().zip(remainder.flipped.iter());
        let labels = of_table.map(|(t, is_flipped)| {
            let [a, b, c, own] = of_input[t];
            if *is_flipped { [a, c, b, own] } else { [a, b, c, own] }
        });
        let base = Labels::new(labels.collect());
        let mut this = Self {
            truth,
            of_input,
            base,
            coarsest: vec![history.level_count(); kinds.len()],
            parted: Vec::new(),
            births: Vec::new(),
            first: vec![(0, Vertex::NONE); table.vertex_slots()],
            rings: Vec::new(),
        };
        this.parted = (0..kinds.len()).map(|k| this.parted(&table, k, kinds[k].domain)).collect();
        let (mut ring, mut slid) = (Ring::default(), slid.iter().peekable());
        for j in 0..history.level_count() {
            this.births.push(history.birth(j).map_or_else(Labels::default, |birth| {
                let labels = this.of_birth(&table, birth);
                birth.undo(&mut table).expect("what is born at a level is there");
                labels
            }));
            for operation in history.level(j) {
                this.base.ring(&table, operation.vertex, operation.site, &mut ring);
                let parting = match slid.next_if(|slid| slid.vertex == operation.vertex) {
                    Some(slid) => ring.parting_of(slid),
                    None => ring.parting(operation.site),
                };
                this.check_rows(j, kinds, &table, operation, &ring, parting);
                let areas: Vec<f64> = ring.corners.iter().map(|&c| area(&table, positions, c)).collect();
                operation
                    .undo(&mut table, history.flips(operation))
                    .expect("a history can be undone on the mesh that it is of");
                // Of two labels of which one has to go, that of the larger triangle stays.
                let larger = |x: usize, y: usize| areas[y] > areas[x];
                this.base.settle(&table, &ring, operation.site, parting, larger);
                this.first[operation.vertex.index()] = (this.rings.len() as u32, ring.first());
                this.rings.extend_from_slice(&ring.labels);
            }
        }
        let there: Vec<Triangle> = table.triangles().collect();
        this.base.compact(&there);
        this
    }

    fn parted(&self, table: &CornerTable, k: usize, domain: Domain) -> f64 {
        let (mut parted, mut all) = (0u32, 0u32);
        let value = |c: Corner| self.truth.value(k, self.base.of(c));
        for c in table.triangles().flat_map(|t| t.corners()).filter(|&c| c < table.opposite(c)) {
            let o = table.opposite(c);
            if o.is_none() {
                continue;
            }
            let of_triangle = |c: Corner| self.truth.value(k, self.base.of_triangle(c.triangle()));
            let differs = match domain {
                Domain::Corner => value(c.next()) != value(o.prev()) || value(c.prev()) != value(o.next()),
                Domain::Triangle => of_triangle(c) != of_triangle(o),
            };
            (parted, all) = (parted + u32::from(differs), all + 1);
        }
        f64::from(parted) / f64::from(all.max(1))
    }

    /// An operation has inserted `v`: labels its star. Room for the corners of that is lent.
    pub fn apply(&self, labels: &mut Labels, table: &CornerTable, v: Vertex, ring: &mut Vec<Corner>) {
        // What a history calls the first end of an edge may be the second here.
        let (first, from) = self.first[v.index()];
        wedges::ring_from(table, v, from, ring);
        let first = first as usize;
        labels.apply(table, ring, &self.rings[first..first + ring.len()]);
    }

    /// Those of the components born at a level, by slot of their own table.
    pub fn birth(&self, level: usize) -> &Labels {
        &self.births[level]
    }

    fn of_birth(&self, table: &CornerTable, birth: &Birth) -> Labels {
        let of = |t: Triangle| {
            let [a, b, _] = birth.table.triangle(t).map(|v| birth.name(v));
            let third = table.find_directed_edge(a, b);
            let [a, b, c] = [third.next(), third.prev(), third].map(|c| self.base.of(c));
            [a, b, c, self.base.of_triangle(third.triangle())]
        };
        Labels::new(birth.table.triangles().map(of).collect())
    }

    /// Columns of triangles must be finer than an operation whose triangles have other values than those that they come from.
    fn check_rows(
        &mut self,
        j: usize,
        kinds: &[Kind],
        table: &CornerTable,
        operation: &Operation,
        ring: &Ring,
        parting: Parting,
    ) {
        let behind = match (operation.site, ring.corners.first()) {
            (Site::Attach(..), Some(&c)) => Some(self.base.of_triangle(table.opposite(c).triangle())),
            _ => None,
        };
        let of_part = |part: usize| parting.triangles_of(part).next().map_or(0, |i| ring.labels[i][3]);
        let differs = |k: usize| {
            let value = |label: u32| self.truth.value(k, label);
            let from = |i: usize| behind.unwrap_or_else(|| of_part(parting.carried(i)));
            ring.labels.iter().enumerate().any(|(i, labels)| value(labels[3]) != value(from(i)))
        };
        for (k, _) in kinds.iter().enumerate().filter(|(_, kind)| kind.domain == Domain::Triangle) {
            if self.coarsest[k] > j && differs(k) {
                self.coarsest[k] = j;
            }
        }
    }
}

/// The square of twice the area of a triangle, in steps of the lattice.
fn area(table: &CornerTable, positions: &[[i32; 3]], c: Corner) -> f64 {
    let [p, q, r] = table.vertices_from(c).map(|v| positions[v.index()].map(f64::from));
    let (x, y) = ([0, 1, 2].map(|k| q[k] - p[k]), [0, 1, 2].map(|k| r[k] - p[k]));
    let cross = [x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]];
    cross.iter().map(|x| x * x).sum()
}
