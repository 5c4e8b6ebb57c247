//! Chapter 13: what the corners and triangles of a mesh have, as it is refined.

use std::collections::BTreeMap;

use super::attribute::Attribute;
use super::container::{ATTRIBUTES, File, Result};
use super::entropy::Code;
use super::further;
use super::numbers::{Numbers, Value, numbers};
use super::residue::{Origins, Whole};
use super::walk::{Edge, Mesh, Walk};
use super::whole_pass::Pass;

/// The attributes of a mesh as it stands.
#[derive(Clone, Default)]
pub struct Attributes {
    /// All of the file.
    pub all: Vec<Attribute>,
    /// Those that are not constant.
    pub about: Vec<Attribute>,
    /// Which have been born.
    pub alive: Vec<bool>,
    /// The wedges of corners.
    pub of: BTreeMap<Edge, usize>,
    /// How many wedges there are.
    pub count: usize,
    /// For each attribute of corners, by wedge.
    pub values: Vec<BTreeMap<usize, Value>>,
    /// For each attribute of triangles, by the vertices of a triangle, sorted.
    pub of_triangles: Vec<BTreeMap<[usize; 3], Value>>,
}

/// What a triangle has: its wedges by vertex, and its own values.
pub struct Had {
    wedges: BTreeMap<usize, usize>,
    own: Vec<Option<Value>>,
}

/// A triangle by its vertices.
pub fn name(mut triangle: [usize; 3]) -> [usize; 3] {
    triangle.sort_unstable();
    triangle
}

/// The corners of a triangle, each with its vertex.
fn corners([x, y, z]: [usize; 3]) -> [(usize, Edge); 3] {
    [(x, (y, z)), (y, (z, x)), (z, (x, y))]
}

impl Attributes {
    /// Before any is born.
    pub fn of(file: &File) -> Self {
        let told = file.attributes.iter().filter(|about| about.constant.is_none());
        Self { all: file.attributes.clone(), ..Self::unborn(&told.cloned().collect::<Vec<_>>()) }
    }

    pub fn unborn(about: &[Attribute]) -> Self {
        Self {
            about: about.to_vec(),
            alive: vec![false; about.len()],
            values: vec![BTreeMap::new(); about.len()],
            of_triangles: vec![BTreeMap::new(); about.len()],
            ..Self::default()
        }
    }

    pub fn is_of_triangles(&self, k: usize) -> bool {
        self.about[k].marks % 2 == 1
    }

    /// Those alive that are of corners.
    pub fn of_corners(&self) -> Vec<usize> {
        (0..self.about.len()).filter(|&k| self.alive[k] && !self.is_of_triangles(k)).collect()
    }

    /// Those born at levels that are asked for.
    pub fn born(&self, asked: impl Fn(u64) -> bool) -> Vec<usize> {
        (0..self.about.len()).filter(|&k| asked(self.about[k].birth)).collect()
    }

    /// §13.3: a whole pass for a mesh.
    pub fn pass(&mut self, code: &mut Code, mesh: &Mesh, told: &[usize]) -> Result<()> {
        let walk = Walk::of(mesh);
        let mut pass = Pass::fresh(self, told);
        pass.vertices(code, self, mesh, &walk)?;
        told.iter()
            .filter(|&&k| self.is_of_triangles(k))
            .collect::<Vec<_>>()
            .into_iter()
            .try_for_each(|&k| pass.triangles(code, self, mesh, &walk, k))
    }

    /// §13, components that are born have a whole pass of what is alive, by themselves.
    pub fn pass_of_components(&self, code: &mut Code, mesh: &Mesh) -> Result<Self> {
        let mut own = Self { count: self.count, ..Self::unborn(&self.about) };
        let alive: Vec<usize> = (0..self.about.len()).filter(|&k| self.alive[k]).collect();
        own.pass(code, mesh, &alive)?;
        Ok(own)
    }

    /// They join the mesh, their vertices numbered from `first` on.
    pub fn join(&mut self, own: Self, first: usize) {
        self.of.extend(own.of.into_iter().map(|((a, b), wedge)| ((first + a, first + b), wedge)));
        self.count = own.count;
        for (values, own) in self.values.iter_mut().zip(own.values) {
            values.extend(own);
        }
        for (values, own) in self.of_triangles.iter_mut().zip(own.of_triangles) {
            values.extend(own.into_iter().map(|(t, value)| (t.map(|v| first + v), value)));
        }
    }

    /// What a triangle has.
    pub fn at(&self, triangle: [usize; 3]) -> Had {
        let wedges = corners(triangle).into_iter().filter_map(|(v, c)| Some((v, *self.of.get(&c)?)));
        Had {
            wedges: wedges.collect(),
            own: self.of_triangles.iter().map(|values| values.get(&name(triangle)).cloned()).collect(),
        }
    }

    /// §13.9: an operation takes a triangle away.
    pub fn take(&mut self, triangle: [usize; 3]) -> Had {
        let had = self.at(triangle);
        for (_, c) in corners(triangle) {
            self.of.remove(&c);
        }
        for values in &mut self.of_triangles {
            values.remove(&name(triangle));
        }
        had
    }

    /// §13.9: it makes one of what another had.
    pub fn give(&mut self, triangle: [usize; 3], had: &Had) {
        let wedges = corners(triangle).into_iter().filter_map(|(v, c)| Some((c, *had.wedges.get(&v)?)));
        self.of.extend(wedges);
        for (values, own) in self.of_triangles.iter_mut().zip(&had.own) {
            values.extend(own.iter().map(|own| (name(triangle), own.clone())));
        }
    }

    /// §13.3: whether two wedges have the same values in some attributes.
    pub fn are_alike(&self, x: usize, y: usize, in_these: &[usize]) -> bool {
        in_these.iter().all(|&k| self.values[k].get(&x) == self.values[k].get(&y))
    }

    /// What attributes say at a corner: nothing of those that are not alive.
    pub fn integers(&self, mesh: &Mesh, c: Edge) -> Vec<Option<Value>> {
        let value = |k: usize| match self.is_of_triangles(k) {
            _ if !self.alive[k] => None,
            true => self.of_triangles[k].get(&name(mesh.triangle(c))).cloned(),
            false => self.values[k].get(&self.of[&c]).cloned(),
        };
        self.with_constants((0..self.about.len()).map(value).collect())
    }

    /// §13.1: of all attributes, with the values of those that are not constant.
    pub fn with_constants(&self, told: Vec<Option<Value>>) -> Vec<Option<Value>> {
        let mut told = told.into_iter();
        let every = self.all.iter().map(|about| match &about.constant {
            Some(value) => Some(Some(value.clone())),
            None => told.next().flatten(),
        });
        every.collect()
    }
}

/// Gives the triangles of a whole the values of their corners; before, what is born at level 0.
pub fn give_values(
    file: &File,
    attributes: &mut Attributes,
    mesh: &Mesh,
    whole: &mut Whole,
    origins: &Origins,
) -> Result<()> {
    if file.attributes.is_empty() {
        return Ok(());
    }
    let walk = Walk::of(mesh);
    let payload = file.payload(ATTRIBUTES, 0);
    let mut code = Code::start(&payload);
    let mut beyond = further::Values::none(whole.triangles.len() - walk.triangles.len(), &attributes.about);
    if !payload.is_empty() {
        beyond = further::read(&mut code, attributes, mesh, &walk, whole, origins)?;
        code.end()?;
    }
    let about = &attributes.all;
    let numbers_of = |values: Vec<Option<Value>>| -> Numbers {
        let value =
            |(k, value): (usize, Option<Value>)| value.flatten().map(|value| numbers(&about[k], &value));
        values.into_iter().enumerate().map(value).collect()
    };
    whole.values = (0..whole.triangles.len())
        .map(|t| match walk.triangles.get(t) {
            Some(&c) => {
                let corners = if origins.turned[t] {
                    [c, mesh.prev(c), mesh.next(c)]
                } else {
                    [c, mesh.next(c), mesh.prev(c)]
                };
                corners.map(|c| numbers_of(attributes.integers(mesh, c)))
            }
            None => beyond
                .at(t - walk.triangles.len(), attributes)
                .map(|told| numbers_of(attributes.with_constants(told))),
        })
        .collect();
    Ok(())
}
