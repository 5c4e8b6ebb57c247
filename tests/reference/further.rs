//! Chapters 13.6 and 13.7: level 0, and what further triangles of the residue have.

use std::collections::BTreeMap;

use super::attribute::Attribute;
use super::attributes::{Attributes, name};
use super::container::{Result, demand};
use super::entropy::{Code, Number};
use super::numbers::Value;
use super::residue::{Origins, Whole};
use super::walk::{Mesh, Walk};
use super::whole_pass::{Pass, fan, listed, read_own};

/// The values of further triangles.
pub struct Values {
    wedges: Vec<[usize; 3]>,
    /// For each attribute.
    own: Vec<Vec<Option<Value>>>,
}

impl Values {
    /// Where nothing is told of them.
    pub fn none(count: usize, about: &[Attribute]) -> Self {
        Self { wedges: vec![], own: vec![vec![None; count]; about.len()] }
    }

    /// At the corners of one.
    pub fn at(&self, t: usize, attributes: &Attributes) -> [Vec<Option<Value>>; 3] {
        [0, 1, 2].map(|corner| {
            let value = |k: usize| match attributes.is_of_triangles(k) {
                true => self.own[k][t].clone(),
                false => self.wedges.get(t).and_then(|t| attributes.values[k].get(&t[corner])).cloned(),
            };
            (0..self.own.len()).map(value).collect()
        })
    }
}

/// The payload of level 0.
pub fn read(
    code: &mut Code,
    attributes: &mut Attributes,
    mesh: &Mesh,
    walk: &Walk,
    whole: &Whole,
    origins: &Origins,
) -> Result<Values> {
    let told = attributes.born(|birth| birth == 0);
    let mut pass = Pass::fresh(attributes, &told);
    pass.vertices(code, attributes, mesh, walk)?;
    let count = whole.triangles.len() - walk.triangles.len();
    let mut further = Values::none(count, &attributes.about);
    if !attributes.of_corners().is_empty() {
        further.wedges = read_wedges(code, attributes, mesh, walk, &mut pass, whole, origins)?;
    }
    for k in (0..attributes.about.len()).filter(|&k| attributes.is_of_triangles(k)).collect::<Vec<_>>() {
        if told.contains(&k) {
            pass.triangles(code, attributes, mesh, walk, k)?;
        }
        let last = walk.triangles.last().map(|&c| name(mesh.triangle(c)));
        let mut p = last.map(|last| attributes.of_triangles[k][&last].clone());
        for value in &mut further.own[k] {
            p = Some(read_own(code, &mut pass.models.columns[k], mesh, p.as_ref())?);
            value.clone_from(&p);
        }
    }
    Ok(further)
}

fn read_wedges(
    code: &mut Code,
    attributes: &mut Attributes,
    mesh: &Mesh,
    walk: &Walk,
    pass: &mut Pass,
    whole: &Whole,
    origins: &Origins,
) -> Result<Vec<[usize; 3]>> {
    // The vertices of the whole that those of the walk are.
    let mut named = BTreeMap::new();
    for (t, corners) in origins.corners.iter().enumerate() {
        named.extend((0..3).map(|k| (corners[k], whole.triangles[t][k])));
    }
    let alive = attributes.of_corners();
    let mut lists: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    let listed = listed(mesh, walk);
    for v in walk.vertices(mesh) {
        let wedges: Vec<usize> = fan(mesh, &listed[v]).iter().map(|c| attributes.of[c]).collect();
        let begins = |i: usize| i == 0 || !attributes.are_alike(wedges[i - 1], wedges[i], &alive);
        let firsts = (0..wedges.len()).filter(|&i| begins(i)).map(|i| wedges[i]);
        lists.entry(named[&v]).or_default().extend(firsts);
    }
    let mut number = Number::FRESH;
    let mut further = vec![];
    let mut newest = None;
    for triangle in &whole.triangles[walk.triangles.len()..] {
        let mut of = [0; 3];
        for (wedge, v) in of.iter_mut().zip(triangle) {
            let list = lists.entry(*v).or_default();
            let n = if list.is_empty() { 0 } else { code.unsigned(&mut number)? as usize };
            demand(n <= list.len(), "13.6: no such wedge")?;
            if n > 0 {
                *wedge = list[n - 1];
                continue;
            }
            let p = list.last().copied().or(newest);
            *wedge = attributes.count;
            attributes.count += 1;
            for &k in &alive {
                pass.models.columns[k].wedge(code, attributes, mesh, (k, *wedge), &[], p)?;
            }
            newest = Some(*wedge);
            list.push(*wedge);
        }
        further.push(of);
    }
    Ok(further)
}
