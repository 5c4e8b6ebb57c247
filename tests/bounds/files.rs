//! Files that are built part by part: sound ones that nobody would write.

use unweld::codec::keyframe;
use unweld::codec::lift::Cells;
use unweld::codec::refinement::{Answers, LevelPass, SegmentModels};
use unweld::codec::residue::Residue;
use unweld::codec::walk::Tour;
use unweld::container::{AtomKind, FileBuilder, Level};
use unweld::entropy::RangeEncoder;
use unweld::limits::Budget;
use unweld::mesh::{Corner, CornerTable, IndexedMesh, Lattice, Vertex};
use unweld::refine::{ProgressiveMesh, Roots};

/// Bits of the lattice of all files here.
const BITS: u32 = 16;

fn lattice() -> Lattice {
    Lattice { origin: [0.0; 3], step: 1.0, bits: BITS }
}

/// A mesh whose coordinates are points of the lattice.
pub fn mesh(mesh: &IndexedMesh) -> ProgressiveMesh {
    let table = CornerTable::from_triangles(mesh.positions.len(), &mesh.triangles).unwrap();
    let roots = Roots::choose(&table);
    let positions = mesh.positions.iter().map(|p| p.map(|x| x as i32)).collect();
    ProgressiveMesh { table, positions, roots }
}

/// A file of one level with a residue.
pub fn with_residue(base: &ProgressiveMesh, residue: &Residue) -> Vec<u8> {
    let mut file = builder(&[counts(base)]);
    file.payload(AtomKind::Base, 0, &keyframe::encode(base, 0, |_, _| 0).payload);
    file.payload(
        AtomKind::Residue,
        0,
        &residue.encode(base, &Tour::new(base), &mut Budget::unlimited()).unwrap(),
    );
    written(file)
}

/// A residue in which each vertex is a group of its own.
pub fn groups_of_one(base: &ProgressiveMesh) -> Residue {
    Residue { groups: (0..base.positions.len() as u32).collect(), ..Residue::default() }
}

/// A file whose levels come about by these operations; each level is one atom.
pub fn with_levels<A: Answers>(
    mut base: ProgressiveMesh,
    levels: u32,
    answers: impl Fn(&ProgressiveMesh) -> A,
) -> Vec<u8> {
    let (mut all, mut atoms) = (vec![counts(&base)], Vec::new());
    let first = keyframe::encode(&base, 0, |_, _| 0).payload;
    let mut models = SegmentModels::default();
    for level in (0..levels).rev() {
        let before = (base.positions.len(), base.table.triangle_count());
        // A writer ends with the last operation: what would be said no to behind it is not asked.
        let mut trial = Under::begin(&base, &models, answers(&base));
        let count = std::iter::from_fn(|| trial.step()).count();
        let mut under = Under::begin(&base, &models, answers(&base));
        (0..count).for_each(|_| under.step().unwrap_or_default());
        (base, models) = (under.mesh, under.models);
        let coder = under.coder;
        let items = (base.positions.len() - before.0) as u32;
        let triangles = (base.table.triangle_count() - before.1) as u32;
        atoms.push((level, items, triangles, coder.finish()));
        all.push(counts(&base));
    }
    all.reverse();
    let mut file = builder(&all);
    file.payload(AtomKind::Base, levels, &first);
    for (level, items, triangles, bytes) in atoms {
        file.atom(AtomKind::Refinement, level, items, triangles, bytes);
    }
    written(file)
}

/// A level that is being written.
struct Under<A> {
    mesh: ProgressiveMesh,
    models: SegmentModels,
    pass: LevelPass,
    coder: RangeEncoder,
    answers: A,
}

impl<A: Answers> Under<A> {
    fn begin(mesh: &ProgressiveMesh, models: &SegmentModels, answers: A) -> Self {
        let pass = LevelPass::new(mesh, Cells { bits: BITS, precision: 0, lifting: 0 });
        Self { mesh: mesh.clone(), models: models.clone(), pass, coder: RangeEncoder::default(), answers }
    }

    fn step(&mut self) -> Option<()> {
        let step = self.pass.step(&mut self.mesh, &mut self.models, &mut self.coder, &mut self.answers);
        step.unwrap().map(|_| ())
    }
}

/// Splits every edge that is the longest in both of its triangles, in the middle.
pub struct Longest {
    /// All positions so far; the last one is that of the current operation.
    positions: Vec<[i32; 3]>,
}

impl Longest {
    /// For the next level of this mesh.
    pub fn new(mesh: &ProgressiveMesh) -> Self {
        Self { positions: mesh.positions.clone() }
    }

    /// Whether the edge opposite to `c` is the longest of its triangle.
    fn is_longest(&self, table: &CornerTable, c: Corner) -> bool {
        let square = |c: Corner| {
            let (a, b) = table.edge(c);
            let (a, b) = (self.positions[a.index()], self.positions[b.index()]);
            (0..3).map(|k| i64::from(a[k] - b[k]).pow(2)).sum::<i64>()
        };
        c.is_none() || square(c) > square(c.next()).max(square(c.prev()))
    }
}

impl Answers for Longest {
    fn split(&mut self, table: &CornerTable, k: Corner) -> bool {
        let (a, b) = table.edge(k);
        let splits = self.is_longest(table, k) && self.is_longest(table, table.opposite(k));
        if splits {
            let (a, b) = (self.positions[a.index()], self.positions[b.index()]);
            self.positions.push(std::array::from_fn(|i| (a[i] + b[i]) / 2));
        }
        splits
    }
    fn flip(&self, _: &CornerTable, _: Corner) -> bool {
        false
    }
    fn face(&mut self, _: &CornerTable, _: Corner) -> bool {
        false
    }
    fn attach(&mut self, _: &CornerTable, _: Corner) -> bool {
        false
    }
    fn vertex(&self, mesh: &ProgressiveMesh) -> Vertex {
        Vertex(mesh.positions.len() as u32)
    }
    fn position(&self) -> [i32; 3] {
        self.positions.last().copied().unwrap_or_default()
    }
}

/// One triangle grows on the first boundary edge that is met.
#[derive(Default)]
pub struct OneEar(bool);

impl Answers for OneEar {
    fn split(&mut self, _: &CornerTable, _: Corner) -> bool {
        false
    }
    fn flip(&self, _: &CornerTable, _: Corner) -> bool {
        false
    }
    fn face(&mut self, _: &CornerTable, _: Corner) -> bool {
        false
    }
    fn attach(&mut self, _: &CornerTable, _: Corner) -> bool {
        !std::mem::replace(&mut self.0, true)
    }
    fn vertex(&self, mesh: &ProgressiveMesh) -> Vertex {
        Vertex(mesh.positions.len() as u32)
    }
    fn position(&self) -> [i32; 3] {
        [7; 3]
    }
}

/// Triangles that have nothing to do with each other.
pub fn pieces(count: u32) -> IndexedMesh {
    let mut mesh = IndexedMesh::default();
    for k in 0..count {
        let x = f64::from(k % 60_000);
        mesh.positions.extend([[x, 0.0, 0.0], [x, 1.0, 0.0], [x, 0.0, 1.0]]);
        mesh.triangles.push([3 * k, 3 * k + 1, 3 * k + 2]);
    }
    mesh
}

fn counts(mesh: &ProgressiveMesh) -> [u32; 2] {
    [mesh.positions.len() as u32, mesh.table.triangle_count() as u32]
}

fn builder(levels: &[[u32; 2]]) -> FileBuilder {
    let level = |&[vertices, triangles]: &[u32; 2]| Level { vertices, triangles, ..Level::default() };
    FileBuilder::new(lattice(), [(1 << BITS) - 1; 3], levels.iter().map(level).collect())
}

fn written(file: FileBuilder) -> Vec<u8> {
    let mut bytes = Vec::new();
    file.write(&mut bytes).unwrap();
    bytes
}
