//! Chapter 5: from a level to the next finer one.

use std::cell::RefCell;
use std::collections::{HashSet, VecDeque};

use super::attributes::Attributes;
use super::codes::Codes;
use super::container::{Atom, Result, demand};
use super::contexts;
use super::coordinates::{self, Reader};
use super::decisions::{self, Clue};
use super::entropy::{Model, Tap};
use super::extent::Extent;
use super::lifting::Scale;
use super::operation::{self, Site};
use super::position::{self, Frame};
use super::trace::Step;
use super::vector::{Vector, dot, larger};
use super::walk::{Edge, Mesh, Walk};

/// The models of a segment (§5.2).
pub struct Models {
    split: decisions::Splits,
    flip: decisions::Flips,
    face: Model,
    attach: Model,
    coordinates: coordinates::Models,
    splits: position::Models,
    precision: [Model; 3],
    /// §13.9; none before the first operation.
    attributes: Option<operation::Models>,
}

impl Models {
    pub fn fresh(rich: bool) -> Self {
        Self {
            split: decisions::Splits::fresh(rich),
            flip: decisions::Flips::fresh(rich),
            face: Model::FRESH,
            attach: Model::FRESH,
            coordinates: coordinates::Models::fresh(),
            splits: position::Models::fresh(),
            precision: [Model::FRESH; 3],
            attributes: None,
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

/// §5.6: from the shift `from` to the shift `to`.
pub fn precision_pass(
    mesh: &mut Mesh,
    atoms: Vec<&Atom>,
    (from, to): (u32, u32),
    models: &mut Models,
) -> Result<()> {
    let mut codes = Codes::of(atoms, None);
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

/// §5.3: to a level of this scale.
pub fn level_pass(
    mesh: &mut Mesh,
    attributes: &mut Attributes,
    atoms: Vec<&Atom>,
    scale: Scale,
    models: &mut Models,
) -> Result<()> {
    trace_with(mesh, attributes, atoms, scale, models, None).1
}

/// The same where there are no attributes; all codes may be tapped. What has been done is told even where it ends in a refusal.
pub fn trace_pass(
    mesh: &mut Mesh,
    atoms: Vec<&Atom>,
    scale: Scale,
    models: &mut Models,
    tap: Option<&RefCell<Tap>>,
) -> (Vec<Step>, Result<()>) {
    trace_with(mesh, &mut Attributes::default(), atoms, scale, models, tap)
}

/// The same, with attributes.
pub fn trace_with(
    mesh: &mut Mesh,
    attributes: &mut Attributes,
    atoms: Vec<&Atom>,
    scale: Scale,
    models: &mut Models,
    tap: Option<&RefCell<Tap>>,
) -> (Vec<Step>, Result<()>) {
    let walk = Walk::of(mesh);
    let old = mesh.points.len();
    let codes = Codes::of(atoms, tap);
    let cells = mesh.points.iter().map(|point| point.map(|x| x >> scale.shift)).collect();
    let (clue, owed, trace) = (Clue::Beside, Vec::new(), Vec::new());
    let mut pass = Pass { mesh, attributes, codes, models, scale, cells, old, clue, owed, trace };
    let result = pass.run(walk);
    (pass.trace, result)
}

struct Pass<'a> {
    mesh: &'a mut Mesh,
    attributes: &'a mut Attributes,
    codes: Codes<'a>,
    models: &'a mut Models,
    scale: Scale,
    /// P.
    cells: Vec<[i64; 3]>,
    /// Vertices from this one on are new.
    old: usize,
    clue: Clue,
    /// §13.9: operations of which nothing has been told.
    owed: Vec<(usize, Site)>,
    trace: Vec<Step>,
}

impl<'a> Pass<'a> {
    fn run(&mut self, walk: Walk) -> Result<()> {
        let boundary = walk.boundary(self.mesh);
        let outline: HashSet<usize> = boundary.iter().flat_map(|&(a, b)| [a, b]).collect();
        if !walk.edges.is_empty() && !self.codes.complete() {
            self.clue = self.models.split.choose(&mut self.codes.code)?;
        }
        for together in walk.edges.chunks(64) {
            let look = |&k: &Edge| contexts::Looked::at(self.mesh, k, |v| self.cell(v));
            let looked: Vec<_> = together.iter().map(look).collect();
            for (&k, looked) in together.iter().zip(looked) {
                self.split(k, looked, &outline)?;
            }
        }
        for c in walk.triangles {
            self.face_split(c)?;
        }
        for edge in boundary {
            self.attach(edge)?;
        }
        demand(self.codes.complete(), "5.2: the pass ends before its atoms")
    }

    /// `looked` is what was seen of the edge when it was looked at (§5.5.2), `outline` are the vertices of the boundary.
    fn split(&mut self, k: Edge, looked: Option<contexts::Looked>, outline: &HashSet<usize>) -> Result<()> {
        let o = (k.1, k.0);
        if self.codes.complete()
            || self.is_starred(k)
            || (self.mesh.third.contains_key(&o) && self.is_starred(o))
        {
            return Ok(());
        }
        let looked = looked.expect("the triangle of an edge that is asked about stood there all along");
        let context = contexts::split(self.mesh, k, looked, |c| self.is_starred(c));
        let yes = self.models.split.read(&mut self.codes.code, context, self.clue)?;
        self.trace.push(Step::Split(k, context, yes));
        if !yes {
            return Ok(());
        }
        let (a, b) = k;
        let start = self.cell(a);
        let frame = Frame::of(self.mesh, k, |v| self.cell(v));
        let (mut reader, splits) = self.reader();
        let cell = position::split(start, frame, splits, &mut reader)?;
        let v = self.vertex(cell, a);
        let c = self.mesh.tip(k);
        let mut link = vec![(b, c), (c, a)];
        let interior = self.mesh.third.get(&o).copied();
        self.replace([c, a, b], &[[c, a, v], [c, v, b]]);
        if let Some(d) = interior {
            if self.scale.factor > 0 && !outline.contains(&a) && !outline.contains(&b) {
                let by = self.scale.lift([a, b, c, d, v].map(|w| self.mesh.points[w]));
                for w in [a, b, v] {
                    self.mesh.points[w] = self.scale.moved(self.mesh.points[w], by)?;
                }
            }
            self.replace([d, b, a], &[[d, b, v], [d, v, a]]);
            link.extend([(a, d), (d, b)]);
        }
        let mut destroyed = vec![(a, b)];
        self.flips(v, link, &mut destroyed)?;
        self.mesh.mend_root(v, &destroyed);
        self.values(v, Site::Split(k))?;
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
            let ends = [destroyed[0].0, destroyed[0].1];
            let context = contexts::Flip {
                flips: destroyed.len() - 1,
                reach: contexts::reach([v, r, p, q].map(|w| self.cell(w))),
                closed: [(p, r), (r, q)].iter().filter(|&&(s, e)| self.is_closed((e, s))).count(),
                end: if ends.contains(&p) { 1 } else { 2 * usize::from(ends.contains(&q)) },
                valences: [p, q, r].map(|w| Extent::of(self.mesh, w, |w| self.cell(w)).edges),
                ..contexts::flip([v, r, p, q].map(|w| self.cell(w)))
            };
            let yes = self.models.flip.read(&mut self.codes.code, context, self.clue)?;
            self.trace.push(Step::Flip((p, q), r, context, yes));
            if yes {
                self.mesh.remove([v, p, q]);
                self.attributes.take([v, p, q]);
                self.replace([r, q, p], &[[v, p, r], [v, r, q]]);
                destroyed.push((p, q));
                queue.extend([(p, r), (r, q)]);
                ring.push(r);
                size += 1;
            }
        }
        Ok(())
    }

    fn face_split(&mut self, c: Edge) -> Result<()> {
        if self.codes.complete() || self.is_starred(c) {
            return Ok(());
        }
        let yes = self.codes.code.read(&mut self.models.face)?;
        let [x, y, z] = self.mesh.triangle(c);
        self.trace.push(Step::Face([x, y, z], yes));
        if !yes {
            return Ok(());
        }
        let start = self.cell(x);
        let [to_y, to_z] = [y, z].map(|w| Vector::between(start, self.cell(w)));
        let size = larger(dot(to_y, to_y), dot(to_z, to_z)).sqrt();
        let cell = position::near(start, (to_y + to_z) * (1.0 / 3.0), size, &mut self.reader().0)?;
        let v = self.vertex(cell, x);
        self.replace([x, y, z], &[[x, y, v], [y, z, v], [z, x, v]]);
        self.values(v, Site::Face([x, y, z]))?;
        self.codes.item(2)
    }

    fn attach(&mut self, (a, b): Edge) -> Result<()> {
        let third = &self.mesh.third;
        let still = third.contains_key(&(a, b)) && !third.contains_key(&(b, a));
        if self.codes.complete() || !still {
            return Ok(());
        }
        let yes = self.codes.code.read(&mut self.models.attach)?;
        self.trace.push(Step::Attach((a, b), yes));
        if !yes {
            return Ok(());
        }
        let start = self.cell(a);
        let edge = Vector::between(start, self.cell(b));
        let cell = position::near(start, edge * 0.5, dot(edge, edge).sqrt(), &mut self.reader().0)?;
        let v = self.vertex(cell, a);
        self.mesh.add([b, a, v]);
        self.attributes.give([b, a, v], &self.attributes.at(self.mesh.triangle((a, b))));
        self.values(v, Site::Attach((a, b)))?;
        self.codes.item(1)
    }

    /// Triangles for one, which have what it had.
    fn replace(&mut self, old: [usize; 3], new: &[[usize; 3]]) {
        self.mesh.remove(old);
        let had = self.attributes.take(old);
        for &triangle in new {
            self.mesh.add(triangle);
            self.attributes.give(triangle, &had);
        }
    }

    /// §13.9: the operation under way is complete.
    fn values(&mut self, v: usize, site: Site) -> Result<()> {
        self.owed.push((v, site));
        if self.owed.len() < 64 && !self.codes.is_last() {
            return Ok(());
        }
        let fresh = || operation::Models::fresh(&self.attributes.about);
        let models = self.models.attributes.get_or_insert_with(fresh);
        for (v, site) in self.owed.drain(..) {
            models.read(&mut self.codes.code, self.attributes, self.mesh, v, site)?;
        }
        Ok(())
    }

    /// What a position is read with; the models are those of splits alone.
    fn reader(&mut self) -> (Reader<'_, 'a>, &mut position::Models) {
        let Models { coordinates, splits, .. } = &mut *self.models;
        let scale = self.scale;
        (Reader { code: &mut self.codes.code, models: coordinates, scale, trace: &mut self.trace }, splits)
    }

    /// A vertex with this cell in the component of another.
    fn vertex(&mut self, cell: [i64; 3], near: usize) -> usize {
        self.cells.push(cell);
        self.mesh.points.push(cell.map(|x| from_cell(x, self.scale.shift)));
        self.mesh.component.push(self.mesh.component[near]);
        self.mesh.points.len() - 1
    }

    fn cell(&self, v: usize) -> [i64; 3] {
        self.cells[v]
    }

    /// Whether the triangle of an edge is none or has a new vertex.
    fn is_closed(&self, (a, b): Edge) -> bool {
        self.mesh.third.get(&(a, b)).is_none_or(|&tip| [tip, a, b].iter().any(|&w| w >= self.old))
    }

    /// Whether a listed triangle has a new vertex by now, or is gone, since it was rewritten with one.
    fn is_starred(&self, c: Edge) -> bool {
        self.mesh.third.get(&c).is_none_or(|&tip| [tip, c.0, c.1].iter().any(|&v| v >= self.old))
    }
}
