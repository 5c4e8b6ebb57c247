//! Chapter 13.3: the wedges of a vertex.

use super::attribute::Attribute;
use super::attributes::Attributes;
use super::column::{Column, Place};
use super::container::Result;
use super::entropy::{Code, Model};
use super::numbers::{cross, dot, minus};
use super::walk::{Edge, Mesh};

/// The models of breaks and of values.
pub struct Models {
    broken: [Model; 3],
    breaks: [[Model; 3]; 3],
    pub columns: Vec<Column>,
}

/// A vertex, and what is told of it.
pub struct Vertex<'a> {
    pub mesh: &'a Mesh,
    /// The corners of its fan.
    pub corners: Vec<Edge>,
    /// The attributes of corners that are alive before.
    pub before: &'a [usize],
    /// Those told.
    pub told: &'a [usize],
}

impl Models {
    pub fn fresh(about: &[Attribute]) -> Self {
        Self {
            broken: [Model::FRESH; 3],
            breaks: [[Model::FRESH; 3]; 3],
            columns: about.iter().map(Column::fresh).collect(),
        }
    }

    /// `is_met` says of which other vertices all has been told.
    pub fn vertex(
        &mut self,
        code: &mut Code,
        attributes: &mut Attributes,
        vertex: Vertex,
        is_met: &dyn Fn(usize) -> bool,
    ) -> Result<()> {
        let Vertex { mesh, corners, before, told } = vertex;
        let k = corners.len();
        let is_boundary = mesh.opposite(mesh.prev(corners[0])).is_none();
        let spokes = usize::from(is_boundary)..k;
        let alive = attributes.of_corners();
        let far = |i: usize| {
            let [x, y] = [mesh.prev(corners[(i + k - 1) % k]), mesh.next(corners[i])];
            match is_met(mesh.tip(x)) {
                false => 0,
                true if attributes.are_alike(attributes.of[&x], attributes.of[&y], &alive) => 1,
                true => 2,
            }
        };
        let mut b = vec![false; k];
        for i in spokes.clone() {
            let wedges = [corners[(i + k - 1) % k], corners[i]].map(|c| attributes.of.get(&c));
            b[i] = match wedges {
                [Some(&x), Some(&y)] => !attributes.are_alike(x, y, before),
                _ => false,
            };
        }
        let open: Vec<usize> = spokes.filter(|&i| !b[i]).collect();
        let parted = open.iter().filter(|&&i| far(i) == 2).count();
        if code.read(&mut self.broken[parted.min(2)])? {
            for i in open {
                let bend = bend(mesh, mesh.next(corners[(i + k - 1) % k]), mesh.prev(corners[i]));
                b[i] = code.read(&mut self.breaks[far(i)][bend])?;
            }
        }
        let s = if is_boundary { 0 } else { b.iter().position(|&b| b).unwrap_or(0) };
        let mut runs: Vec<Vec<Edge>> = vec![];
        for i in (s..k).chain(0..s) {
            if i == s || b[i] {
                runs.push(vec![]);
            }
            runs.last_mut().expect("the first corner begins a run").push(corners[i]);
        }
        let mut here: Vec<usize> = vec![];
        for run in runs {
            let was = attributes.of.get(&run[0]).copied();
            let wedge = was.filter(|was| !here.contains(was)).unwrap_or(attributes.count);
            if wedge == attributes.count {
                attributes.count += 1;
                for &k in was.map_or(&[][..], |_| before) {
                    let value = attributes.values[k][&was.expect("there is one")].clone();
                    attributes.values[k].insert(wedge, value);
                }
            }
            for &k in told {
                self.columns[k].wedge(code, attributes, mesh, (k, wedge), &run, here.last().copied())?;
            }
            attributes.of.extend(run.iter().map(|&c| (c, wedge)));
            here.push(wedge);
        }
        Ok(())
    }
}

impl Column {
    /// The value of a wedge of corners, in attribute k; p is the wedge before.
    pub fn wedge(
        &mut self,
        code: &mut Code,
        attributes: &mut Attributes,
        mesh: &Mesh,
        (k, wedge): (usize, usize),
        corners: &[Edge],
        p: Option<usize>,
    ) -> Result<()> {
        let (of, values) = (&attributes.of, &attributes.values[k]);
        let p = p.map(|p| &values[&p]);
        let value = self.read(code, &Place { mesh, of, values, corners }, Some(wedge), p)?;
        attributes.values[k].insert(wedge, value);
        Ok(())
    }
}

fn bend(mesh: &Mesh, c: Edge, o: Edge) -> usize {
    let [m, n] = [c, o].map(|c| {
        let [x, y, z] = mesh.triangle(c).map(|v| mesh.points[v].map(|q| q as f64));
        cross(minus(y, x), minus(z, x))
    });
    let (d, q) = (dot(m, n), dot(m, m) * dot(n, n));
    match () {
        () if d > 0.0 && d * d >= 0.8836 * q => 0,
        () if d > 0.0 && d * d >= 0.25 * q => 1,
        () => 2,
    }
}
