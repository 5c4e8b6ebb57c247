//! Chapter 8: what no manifold holds, and the whole of level 0.

use std::collections::BTreeMap;

use super::container::{File, RESIDUE, Result, demand, refuse};
use super::entropy::{Code, Model, Number};
use super::numbers::Numbers;
use super::walk::{Mesh, Walk};

/// Vertices and triangles of the whole of level 0 (§8.5), and, in the end, those of the input (§10, §11).
#[derive(Debug, PartialEq)]
pub struct Whole {
    pub positions: Vec<[f64; 3]>,
    pub triangles: Vec<[usize; 3]>,
    /// What attributes say at the corners of the triangles (§13); nothing where the file has none.
    pub values: Vec<[Numbers; 3]>,
}

/// What the chapters after this one want to know of a whole.
pub struct Origins {
    /// The lattice points of its vertices; none for the far ones.
    pub points: Vec<Option<[i64; 3]>>,
    /// The corners of the walk's triangles, as vertices of the mesh, in the order of the whole.
    pub corners: Vec<[usize; 3]>,
    /// Whether they are turned.
    pub turned: Vec<bool>,
}

/// What a residue says; by default, nothing.
#[derive(Default)]
struct Residue {
    turned: Vec<bool>,
    group: Vec<Option<usize>>,
    further: Vec<Further>,
    triangles: Vec<[usize; 3]>,
}

enum Further {
    Near([i64; 3]),
    Far([f64; 3]),
}

/// Level 0 with the file's residue.
pub fn whole(file: &File, mesh: &Mesh) -> Result<(Whole, Origins)> {
    let walk = Walk::of(mesh);
    let vertices = walk.vertices(mesh);
    let payload = file.payload(RESIDUE, 0);
    let nothing = Residue {
        turned: vec![false; walk.triangles.len()],
        group: vec![None; vertices.len()],
        ..Residue::default()
    };
    let residue = if payload.is_empty() { nothing } else { read(&payload, mesh, &vertices, nothing)? };
    Ok(assemble(file, mesh, &walk, &vertices, residue))
}

fn read(payload: &[u8], mesh: &Mesh, vertices: &[usize], mut residue: Residue) -> Result<Residue> {
    let mut code = Code::start(payload);
    if code.even()? {
        let mut models = [Model::FRESH; 2];
        let mut last = false;
        for turned in &mut residue.turned {
            last = code.read(&mut models[usize::from(last)])?;
            *turned = last;
        }
    }
    if code.even()? {
        let mut models = [Model::FRESH; 2];
        let mut number = Number::FRESH;
        let (mut last, mut count) = (false, 0);
        let mut here: BTreeMap<[i64; 3], Vec<usize>> = BTreeMap::new();
        for (group, &v) in residue.group.iter_mut().zip(vertices) {
            last = code.read(&mut models[usize::from(last)])?;
            if !last {
                continue;
            }
            let list = here.entry(mesh.points[v]).or_default();
            let k = if list.is_empty() { 0 } else { code.unsigned(&mut number)? as usize };
            if k == 0 {
                list.push(count);
                *group = Some(count);
                count += 1;
            } else {
                demand(k <= list.len(), "8.2: no such group")?;
                *group = Some(list[k - 1]);
            }
        }
    }
    residue.further = read_further(&mut code)?;
    residue.triangles = read_triangles(&mut code, vertices.len() + residue.further.len())?;
    code.end()?;
    Ok(residue)
}

fn read_further(code: &mut Code) -> Result<Vec<Further>> {
    let mut number = Number::FRESH;
    let near = code.unsigned(&mut number)?;
    let far = code.unsigned(&mut number)?;
    let mut further = Vec::new();
    let mut axes = vec![Number::FRESH; 3];
    let mut q = [0; 3];
    for _ in 0..near {
        for i in 0..3 {
            q[i] += code.signed(&mut axes[i])?;
        }
        demand(q.iter().all(|x| -1 << 30 < *x && *x < 1 << 30), "8.3: too far from the lattice")?;
        further.push(Further::Near(q));
    }
    for _ in 0..far {
        let mut position = [0.0; 3];
        for x in &mut position {
            let mut bits = 0;
            for _ in 0..64 {
                bits = bits << 1 | u64::from(code.even()?);
            }
            *x = f64::from_bits(bits);
        }
        demand(position.iter().all(|x| x.is_finite()), "8.3: a position that is not finite")?;
        further.push(Further::Far(position));
    }
    Ok(further)
}

fn read_triangles(code: &mut Code, vertices: usize) -> Result<Vec<[usize; 3]>> {
    let mut triangles = Vec::new();
    let mut number = Number::FRESH;
    let mut steps = vec![Number::FRESH; 3];
    let mut last = 0;
    for _ in 0..code.unsigned(&mut number)? {
        let a = last + code.signed(&mut steps[0])?;
        let b = a + code.signed(&mut steps[1])?;
        let c = a + code.signed(&mut steps[2])?;
        if [a, b, c].iter().any(|v| !(0..vertices as i64).contains(v)) {
            return refuse("8.4: no such vertex");
        }
        triangles.push([a as usize, b as usize, c as usize]);
        last = a;
    }
    Ok(triangles)
}

/// §8.5.
fn assemble(file: &File, mesh: &Mesh, walk: &Walk, vertices: &[usize], residue: Residue) -> (Whole, Origins) {
    let (mut positions, mut points) = (Vec::new(), Vec::new());
    let mut first_of_group = BTreeMap::new();
    // For each name, a place in the walk or V plus one among the further vertices, the vertex of the whole.
    let mut named = Vec::new();
    for (&v, group) in vertices.iter().zip(residue.group) {
        let known = group.and_then(|g| first_of_group.get(&g).copied());
        let number = known.unwrap_or_else(|| {
            positions.push(file.position(mesh.points[v]));
            points.push(Some(mesh.points[v]));
            positions.len() - 1
        });
        if let Some(group) = group {
            first_of_group.insert(group, number);
        }
        named.push(number);
    }
    for further in residue.further {
        named.push(positions.len());
        let (position, point) = match further {
            Further::Near(q) => (file.position(q), Some(q)),
            Further::Far(p) => (p, None),
        };
        positions.push(position);
        points.push(point);
    }
    let place: BTreeMap<usize, usize> = vertices.iter().enumerate().map(|(place, &v)| (v, place)).collect();
    let turn = |([x, y, z], turned): ([usize; 3], bool)| if turned { [x, z, y] } else { [x, y, z] };
    let corners: Vec<[usize; 3]> = walk
        .triangles
        .iter()
        .map(|&c| mesh.triangle(c))
        .zip(residue.turned.iter().copied())
        .map(turn)
        .collect();
    let mut triangles: Vec<_> = corners.iter().map(|t| t.map(|v| named[place[&v]])).collect();
    triangles.extend(residue.triangles.iter().map(|t| t.map(|name| named[name])));
    (Whole { positions, triangles, values: vec![] }, Origins { points, corners, turned: residue.turned })
}
