//! Chapter 5: from a level to the next finer one.

use std::collections::VecDeque;

use super::container::{Atom, Result, demand, refuse};
use super::contexts;
use super::entropy::{Code, Model, Number};
use super::walk::{Edge, Mesh, Walk};

/// The models of a segment (§5.2).
pub struct Models {
    split: [[[Model; 9]; 5]; 2],
    flip: [[Model; 8]; 6],
    face: Model,
    attach: Model,
    position: Vec<Vec<Number>>,
    precision: [Model; 3],
}

impl Models {
    pub fn fresh() -> Self {
        Self {
            split: [[[Model::FRESH; 9]; 5]; 2],
            flip: [[Model::FRESH; 8]; 6],
            face: Model::FRESH,
            attach: Model::FRESH,
            position: vec![vec![Number::FRESH; 33]; 3],
            precision: [Model::FRESH; 3],
        }
    }
}

/// §2.4: the middle of a cell.
pub fn from_cell(x: i64, shift: u32) -> i64 {
    (x << shift) + ((1 << shift) >> 1)
}

/// Number of bits of a number: 0 for 0, else 1 + floor(log2 m).
pub fn bit_length(m: i64) -> usize {
    (0..).find(|&n| m < 1 << n).unwrap_or(63)
}

/// The atoms of a pass, one code after the other (§5.2).
struct Codes<'a> {
    atoms: VecDeque<&'a Atom>,
    code: Code<'a>,
    /// What the first of `atoms` still lacks.
    items: u64,
    triangles: u64,
}

impl<'a> Codes<'a> {
    fn of(atoms: Vec<&'a Atom>) -> Self {
        let mut codes = Self { atoms: atoms.into(), code: Code::start(&[]), items: 0, triangles: 0 };
        codes.open();
        codes
    }

    fn open(&mut self) {
        if let Some(atom) = self.atoms.front() {
            (self.code, self.items, self.triangles) = (Code::start(&atom.bytes), atom.items, atom.triangles);
        }
    }

    /// Says that an item is complete, which added so many triangles.
    fn item(&mut self, triangles: u64) -> Result<()> {
        demand(triangles <= self.triangles, "5.2: triangles of an atom")?;
        self.triangles -= triangles;
        self.items -= 1;
        if self.items == 0 {
            demand(self.triangles == 0, "5.2: triangles of an atom")?;
            std::mem::replace(&mut self.code, Code::start(&[])).end()?;
            self.atoms.pop_front();
            self.open();
        }
        Ok(())
    }

    fn complete(&self) -> bool {
        self.atoms.is_empty()
    }
}

/// §5.6: from the shift `from` to the shift `to`.
pub fn precision_pass(
    mesh: &mut Mesh,
    atoms: Vec<&Atom>,
    (from, to): (u32, u32),
    models: &mut Models,
) -> Result<()> {
    let mut codes = Codes::of(atoms);
    let vertices = Walk::of(mesh).vertices(mesh);
    for t in (to..from).rev() {
        for &v in &vertices {
            demand(!codes.complete(), "3.3: precision items")?;
            for axis in 0..3 {
                let x = &mut mesh.points[v][axis];
                let bit = i64::from(codes.code.read(&mut models.precision[axis])?);
                *x = from_cell(((*x >> (t + 1)) << 1) | bit, t);
            }
            codes.item(0)?;
        }
    }
    demand(codes.complete(), "5.2: the pass ends before its atoms")
}

/// §5.3: to a level of this shift, on a lattice of so many bits.
pub fn level_pass(
    mesh: &mut Mesh,
    atoms: Vec<&Atom>,
    (shift, bits): (u32, u32),
    models: &mut Models,
) -> Result<()> {
    let walk = Walk::of(mesh);
    let boundary = walk.boundary(mesh);
    let old = mesh.points.len();
    let mut pass = Pass { mesh, codes: Codes::of(atoms), models, shift, bits, old };
    for k in walk.edges {
        pass.split(k)?;
    }
    for c in walk.triangles {
        pass.face_split(c)?;
    }
    for edge in boundary {
        pass.attach(edge)?;
    }
    demand(pass.codes.complete(), "5.2: the pass ends before its atoms")
}

struct Pass<'a> {
    mesh: &'a mut Mesh,
    codes: Codes<'a>,
    models: &'a mut Models,
    shift: u32,
    bits: u32,
    /// Vertices from this one on are new.
    old: usize,
}

impl Pass<'_> {
    fn split(&mut self, k: Edge) -> Result<()> {
        let o = (k.1, k.0);
        if self.codes.complete()
            || self.is_starred(k)
            || (self.mesh.third.contains_key(&o) && self.is_starred(o))
        {
            return Ok(());
        }
        let [kind, closed, ratio] = contexts::split(self.mesh, k, |v| self.cell(v), |c| self.is_starred(c));
        if !self.codes.code.read(&mut self.models.split[kind][closed][ratio])? {
            return Ok(());
        }
        let (a, b) = k;
        let (p, q) = (self.cell(a), self.cell(b));
        let v = self.vertex(0, [0, 1, 2].map(|i| (p[i] + q[i]) / 2), contexts::extent(p, q), a)?;
        let c = self.mesh.tip(k);
        let mut link = vec![(b, c), (c, a)];
        let interior = self.mesh.third.get(&o).copied();
        self.mesh.remove([c, a, b]);
        self.mesh.add([c, a, v]);
        self.mesh.add([c, v, b]);
        if let Some(d) = interior {
            self.mesh.remove([d, b, a]);
            self.mesh.add([d, b, v]);
            self.mesh.add([d, v, a]);
            link.extend([(a, d), (d, b)]);
        }
        let mut destroyed = vec![(a, b)];
        self.flips(v, link, &mut destroyed)?;
        self.mesh.mend_root(v, &destroyed);
        self.codes.item(if interior.is_some() { 2 } else { 1 })
    }

    fn flips(&mut self, v: usize, link: Vec<Edge>, destroyed: &mut Vec<Edge>) -> Result<()> {
        let mut ring: Vec<usize> = link.iter().flat_map(|&(p, q)| [p, q]).collect();
        let mut size = link.len();
        let mut queue = VecDeque::from(link);
        while size < 64
            && let Some((p, q)) = queue.pop_front()
        {
            let Some(&r) = self.mesh.third.get(&(q, p)) else { continue };
            if [p, q, r].iter().any(|&w| w >= self.old && w != v) || r == v || ring.contains(&r) {
                continue;
            }
            let angle = contexts::angle([v, r, p, q].map(|w| self.cell(w)));
            if self.codes.code.read(&mut self.models.flip[(size - 2).min(5)][angle])? {
                self.mesh.remove([v, p, q]);
                self.mesh.remove([r, q, p]);
                self.mesh.add([v, p, r]);
                self.mesh.add([v, r, q]);
                destroyed.push((p, q));
                queue.extend([(p, r), (r, q)]);
                ring.push(r);
                size += 1;
            }
        }
        Ok(())
    }

    fn face_split(&mut self, c: Edge) -> Result<()> {
        if self.codes.complete() || self.is_starred(c) || !self.codes.code.read(&mut self.models.face)? {
            return Ok(());
        }
        let [x, y, z] = self.mesh.triangle(c);
        let [p, q, r] = [x, y, z].map(|w| self.cell(w));
        let extent = contexts::extent(p, q).max(contexts::extent(q, r));
        let v = self.vertex(1, [0, 1, 2].map(|i| (p[i] + q[i] + r[i]) / 3), extent, x)?;
        self.mesh.remove([x, y, z]);
        for (a, b) in [(x, y), (y, z), (z, x)] {
            self.mesh.add([a, b, v]);
        }
        self.codes.item(2)
    }

    fn attach(&mut self, (a, b): Edge) -> Result<()> {
        let third = &self.mesh.third;
        let still = third.contains_key(&(a, b)) && !third.contains_key(&(b, a));
        if self.codes.complete() || !still || !self.codes.code.read(&mut self.models.attach)? {
            return Ok(());
        }
        let (p, q) = (self.cell(a), self.cell(b));
        let v = self.vertex(2, [0, 1, 2].map(|i| (p[i] + q[i]) / 2), contexts::extent(p, q), a)?;
        self.mesh.add([b, a, v]);
        self.codes.item(1)
    }

    /// §5.4: a vertex in the component of another.
    fn vertex(&mut self, kind: usize, prediction: [i64; 3], context: usize, near: usize) -> Result<usize> {
        let mut cell = prediction;
        for x in &mut cell {
            *x += self.codes.code.signed(&mut self.models.position[kind][context])?;
        }
        if cell.iter().any(|x| !(0..1 << (self.bits - self.shift)).contains(x)) {
            return refuse("5.4: off the lattice");
        }
        self.mesh.points.push(cell.map(|x| from_cell(x, self.shift)));
        self.mesh.component.push(self.mesh.component[near]);
        Ok(self.mesh.points.len() - 1)
    }

    fn cell(&self, v: usize) -> [i64; 3] {
        self.mesh.points[v].map(|x| x >> self.shift)
    }

    /// Whether a listed triangle has a new vertex by now, or is gone, since it was rewritten with one.
    fn is_starred(&self, c: Edge) -> bool {
        self.mesh.third.get(&c).is_none_or(|&tip| [tip, c.0, c.1].iter().any(|&v| v >= self.old))
    }
}
