//! Chapter 11: the order of the input.

use std::collections::BTreeMap;

use super::container::{File, ORDER, Result, demand, refuse};
use super::entropy::{Code, Model, Number};
use super::residue::{Origins, Whole};
use super::walk::Mesh;

/// A whole in the order of the input, if the file has it.
pub fn put_in_order(file: &File, mesh: &Mesh, whole: Whole, origins: &Origins) -> Result<Whole> {
    let payload = file.payload(ORDER, 0);
    if payload.is_empty() {
        return Ok(whole);
    }
    let mut code = Code::start(&payload);
    let whole = read_order(&mut code, mesh, &whole, origins)?;
    code.end()?;
    Ok(whole)
}

/// §11, up to the end of the code.
pub fn read_order(code: &mut Code, mesh: &Mesh, whole: &Whole, origins: &Origins) -> Result<Whole> {
    let turned = read_triangles(code, &Surface::of(mesh, origins), whole)?;
    let triangles: Vec<_> = turned.iter().map(|t| t.map(|(place, k)| whole.triangles[place][k])).collect();
    let (corners, instances) = read_instances(code, &triangles, whole.positions.len())?;
    let order = read_vertices(code, &corners, instances.len())?;
    let number: BTreeMap<usize, usize> =
        order.iter().enumerate().map(|(k, &instance)| (instance, k)).collect();
    Ok(Whole {
        positions: order.iter().map(|&instance| whole.positions[instances[instance]]).collect(),
        triangles: corners.iter().map(|t| t.map(|instance| number[&instance])).collect(),
        values: match whole.values.is_empty() {
            true => vec![],
            false => turned.iter().map(|t| t.map(|(place, k)| whole.values[place][k].clone())).collect(),
        },
    })
}

/// Neighbours of the triangles of the walk, by places.
struct Surface<'a> {
    mesh: &'a Mesh,
    origins: &'a Origins,
    place: BTreeMap<[usize; 3], usize>,
}

impl<'a> Surface<'a> {
    fn of(mesh: &'a Mesh, origins: &'a Origins) -> Self {
        let name = |mut t: [usize; 3]| {
            t.sort_unstable();
            t
        };
        let place = origins.corners.iter().enumerate().map(|(place, &t)| (name(t), place)).collect();
        Self { mesh, origins, place }
    }

    /// The place across the edge that a corner of the whole's triangle faces, and the corner there that faces it.
    fn across(&self, place: usize, corner: usize) -> Option<(usize, usize)> {
        let t = self.origins.corners.get(place)?;
        let (mut y, mut z) = (t[(corner + 1) % 3], t[(corner + 2) % 3]);
        if self.origins.turned[place] {
            (y, z) = (z, y);
        }
        let &tip = self.mesh.third.get(&(z, y))?;
        let mut name = [y, z, tip];
        name.sort_unstable();
        let other = self.place[&name];
        let facing = self.origins.corners[other].iter().position(|&v| v == tip)?;
        Some((other, facing))
    }
}

fn three(code: &mut Code, m: &mut [Model; 2]) -> Result<usize> {
    if !code.read(&mut m[0])? {
        return Ok(0);
    }
    Ok(1 + usize::from(code.read(&mut m[1])?))
}

/// §11.1: the triangles of the input; of each corner the triangle of the whole and its place there.
fn read_triangles(code: &mut Code, surface: &Surface, whole: &Whole) -> Result<Vec<[(usize, usize); 3]>> {
    let mut numbers = vec![Number::FRESH; 5];
    let mut jumps = Number::FRESH;
    let mut near = [[Model::FRESH; 5]; 5];
    let mut which = [[[Model::FRESH; 2]; 8]; 4];
    let mut turn = [[[Model::FRESH; 2]; 3]; 3];
    let mut jump = [Model::FRESH; 2];
    let (mut s, mut r) = (0, 0);
    let mut left: Vec<usize> = (0..whole.triangles.len()).collect();
    // Place and first corner of each triangle.
    let mut read: Vec<(usize, usize)> = Vec::new();
    for t in 0..whole.triangles.len() {
        let (place, first, found);
        if t > 0 && code.read(&mut near[s][r])? {
            let age = code.unsigned(&mut numbers[s])? as usize;
            demand(age < t, "11.1: age")?;
            let (there, turned) = read[t - 1 - age];
            let mut open = Vec::new();
            for i in 0..3 {
                if let Some((other, facing)) = surface.across(there, (i + turned) % 3)
                    && left.contains(&other)
                {
                    open.push((i, other, facing));
                }
            }
            demand(!open.is_empty(), "11.1: no neighbour is left")?;
            let m: usize = open.iter().map(|&(i, ..)| 1 << i).sum();
            let mut at = 0;
            while at < open.len() - 1 && code.read(&mut which[age.min(3)][m][at])? {
                at += 1;
            }
            let (i, other, facing) = open[at];
            let x = three(code, &mut turn[age.min(2)][i])?;
            (place, first) = (other, (facing + 3 - x) % 3);
            let length = if age == 0 { 0 } else { 1 + age.ilog2() as usize };
            found = 1 + length.min(3);
        } else {
            let before =
                read.last().map_or(0, |&(last, _)| left.iter().filter(|&&place| place < last).count());
            let k = before as i64 + code.signed(&mut jumps)?;
            demand((0..left.len() as i64).contains(&k), "11.1: no such triangle is left")?;
            place = left[k as usize];
            first = if place < surface.origins.corners.len() { three(code, &mut jump)? } else { 0 };
            found = 0;
        }
        (s, r) = (found, s);
        left.retain(|&other| other != place);
        read.push((place, first));
    }
    Ok(read.into_iter().map(|(place, first)| [0, 1, 2].map(|i| (place, (first + i) % 3))).collect())
}

/// §11.2: the instances at the corners, and the vertices of the instances.
fn read_instances(
    code: &mut Code,
    triangles: &[[usize; 3]],
    v: usize,
) -> Result<(Vec<[usize; 3]>, Vec<usize>)> {
    let mut more = Number::FRESH;
    let u = v + code.unsigned(&mut more)? as usize;
    let (mut instances, mut of, mut now) = (Vec::new(), vec![Vec::new(); v], vec![0; v]);
    let mut add = |vertex: usize, of: &mut Vec<Vec<usize>>, now: &mut Vec<usize>| {
        of[vertex].push(instances.len());
        instances.push(vertex);
        now[vertex] = of[vertex].len() - 1;
        instances.len()
    };
    let mut count = 0;
    let mut fresh = [[Model::FRESH; 3]; 2];
    let mut other = [Model::FRESH; 3];
    let mut last = true;
    let mut choice = Number::FRESH;
    let mut corners = triangles.to_vec();
    for corner in corners.as_flattened_mut() {
        let vertex = *corner;
        let n = of[vertex].len();
        if n == 0 {
            count = add(vertex, &mut of, &mut now);
        } else if u > v {
            last = code.read(&mut fresh[usize::from(last)][n.min(3) - 1])?;
            if last {
                count = add(vertex, &mut of, &mut now);
            } else if n > 1 && code.read(&mut other[n.min(4) - 2])? {
                let mut k = 0;
                if n > 2 {
                    k = code.unsigned(&mut choice)? as usize;
                    demand(k <= n - 2, "11.2: no such instance")?;
                }
                k = n - 1 - k;
                if k <= now[vertex] {
                    k -= 1;
                }
                now[vertex] = k;
            }
        }
        *corner = of[vertex][now[vertex]];
    }
    for vertex in 0..v {
        if of[vertex].is_empty() {
            count = add(vertex, &mut of, &mut now);
        }
    }
    demand(count <= u, "11.2: too many instances")?;
    let (mut steps, mut vertex) = (Number::FRESH, 0);
    while count < u {
        vertex += code.unsigned(&mut steps)? as usize;
        demand(vertex < v, "11.2: no such vertex")?;
        count = add(vertex, &mut of, &mut now);
    }
    Ok((corners, instances))
}

/// §11.3: the instances in the order of the input.
fn read_vertices(code: &mut Code, corners: &[[usize; 3]], u: usize) -> Result<Vec<usize>> {
    let mut next = [[Model::FRESH; 3]; 3];
    let mut beside = [[Model::FRESH; 3]; 3];
    let mut pick = [[Model::FRESH; 8]; 8];
    let mut jumps = Number::FRESH;
    let (mut s, mut r) = (0, 0);
    let mut left: Vec<usize> = (0..u).collect();
    let mut order: Vec<usize> = Vec::new();
    for _ in 0..u {
        let last = order.last().copied();
        let p = last.map_or(0, |last| left.iter().filter(|&&instance| instance < last).count()) as i64;
        let mut q = p;
        let is_next = code.read(&mut next[s][r])?;
        let mut found = if is_next { 0 } else { 2 };
        if !is_next {
            let mut open = Vec::new();
            for w in corners.iter().filter(|t| t.iter().any(|&w| Some(w) == last)).flatten() {
                if left.contains(w) && !open.contains(w) {
                    open.push(*w);
                }
            }
            if !open.is_empty() && code.read(&mut beside[s][r])? {
                let mut i = 0;
                while i < open.len() - 1 && code.read(&mut pick[open.len().min(8) - 1][i.min(7)])? {
                    i += 1;
                }
                let Some(at) = left.iter().position(|&w| w == open[i]) else { return refuse("11.3") };
                (q, found) = (at as i64, 1);
            } else {
                q = p + code.signed(&mut jumps)?;
            }
        }
        demand((0..left.len() as i64).contains(&q), "11.3: no such vertex is left")?;
        order.push(left.remove(q as usize));
        (s, r) = (found, s);
    }
    Ok(order)
}
