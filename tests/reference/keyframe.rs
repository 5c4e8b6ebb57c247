//! Chapter 7: a whole level.

use std::collections::BTreeSet;

use super::connectivity::{self, Gluing, next, prev};
use super::container::{Fields, Level, Result, demand};
use super::entropy::{Code, Model, Number};
use super::lifting::Scale;
use super::other::Other;
use super::refinement::{bit_length, from_cell};
use super::walk::{Mesh, Walk};

/// The level in the payload of a base or keyframe; of this scale.
pub fn read(payload: &[u8], level: Level, scale: Scale) -> Result<Mesh> {
    read_with(payload, level, scale, &mut |_, _| Ok(()))
}

/// The same, with what reads the values behind the positions (§13).
pub fn read_with(payload: &[u8], level: Level, scale: Scale, behind: Behind) -> Result<Mesh> {
    read_payload(payload, level, scale, [0; 3], behind, None)
}

/// §15.2: the same beside another mesh, whose vertices these are in the order of its walk.
pub fn read_beside(
    payload: &[u8],
    level: Level,
    scale: Scale,
    other: &[[i64; 3]],
    behind: Behind,
) -> Result<Mesh> {
    read_payload(payload, level, scale, [0; 3], behind, Some(Other::fresh(other)))
}

/// §7.4: components that are born.
pub fn read_birth(payload: &[u8], level: Level, scale: Scale, behind: Behind) -> Result<Mesh> {
    read_payload(payload, level, scale, [0, 34, 35], behind, None)
}

/// Reads on, of this mesh.
pub type Behind<'a> = &'a mut dyn FnMut(&mut Code, &Mesh) -> Result<()>;

/// §7.4: they join the mesh, behind all that it has.
pub fn join(mesh: &mut Mesh, born: Mesh) {
    let (vertices, components) = (mesh.component.len(), mesh.roots.len());
    mesh.component.extend(born.component.iter().map(|i| components + i));
    mesh.points.extend(born.points);
    mesh.roots.extend(born.roots.iter().map(|(u, w)| (vertices + u, vertices + w)));
    let triangles = born.third.iter().map(|(&(a, b), &c)| ((vertices + a, vertices + b), vertices + c));
    mesh.third.extend(triangles);
}

fn read_payload(
    payload: &[u8],
    level: Level,
    scale: Scale,
    first: [usize; 3],
    behind: Behind,
    other: Option<Other>,
) -> Result<Mesh> {
    let mut fields = Fields(payload);
    let boundary = fields.varint()?;
    let mut code = Code::start(fields.0);
    let mesh = read_code_beside(&mut code, boundary, level, scale, first, other)?;
    behind(&mut code, &mesh)?;
    code.end()?;
    Ok(mesh)
}

/// The same from the code behind the number of boundary edges; `first` are the contexts of the first triangles' vertices.
pub fn read_code(
    code: &mut Code,
    boundary: u64,
    level: Level,
    scale: Scale,
    first: [usize; 3],
) -> Result<Mesh> {
    read_code_beside(code, boundary, level, scale, first, None)
}

fn read_code_beside(
    code: &mut Code,
    boundary: u64,
    level: Level,
    scale: Scale,
    first: [usize; 3],
    other: Option<Other>,
) -> Result<Mesh> {
    demand(boundary <= 3 * level.triangles, "7: boundary edges")?;
    let count = level.triangles + boundary;
    demand(count < 1 << 30, "7: triangles and caps")?;
    let gluing = connectivity::read(code, count as usize)?;
    let fans = Fans::of(&gluing);
    let caps = read_caps(code, &gluing, &fans, boundary)?;
    let mut mesh = open(&gluing, &fans, &caps, boundary)?;
    demand(mesh.component.len() as u64 == level.vertices, "7.1.1: number of vertices")?;
    mesh.points = read_positions(code, &mesh, scale, first, other)?;
    Ok(mesh)
}

/// The vertices of a closed surface: cycles of swing.
struct Fans {
    /// Vertices of the corners, numbered as they are met by §7.1.1.
    vertex: Vec<usize>,
    /// Numbers of corners at the vertices.
    valence: Vec<usize>,
}

impl Fans {
    fn of(gluing: &Gluing) -> Self {
        let mut vertex = vec![usize::MAX; gluing.opposite.len()];
        let mut valence = Vec::new();
        for t in (0..gluing.opposite.len() / 3).rev() {
            for first in [3 * t, 3 * t + 1, 3 * t + 2] {
                if vertex[first] != usize::MAX {
                    continue;
                }
                let mut c = first;
                let mut corners = 0;
                loop {
                    vertex[c] = valence.len();
                    corners += 1;
                    c = next(gluing.opposite[next(c)]);
                    if c == first {
                        break;
                    }
                }
                valence.push(corners);
            }
        }
        Self { vertex, valence }
    }
}

/// §7.1.1: the tips of caps.
fn read_caps(code: &mut Code, gluing: &Gluing, fans: &Fans, boundary: u64) -> Result<BTreeSet<usize>> {
    let mut caps = BTreeSet::new();
    let mut models = [Model::FRESH; 32];
    let mut corners = vec![Vec::new(); fans.valence.len()];
    for (c, &vertex) in fans.vertex.iter().enumerate() {
        corners[vertex].push(c);
    }
    let first: BTreeSet<usize> = gluing.starts.iter().map(|c| c / 3).collect();
    for (vertex, &valence) in fans.valence.iter().enumerate() {
        let begins = corners[vertex].iter().any(|c| first.contains(&(c / 3)));
        let beside_cap = corners[vertex]
            .iter()
            .any(|&c| [next(c), prev(c)].iter().any(|c| caps.contains(&fans.vertex[*c])));
        if boundary == 0 || begins || beside_cap {
            continue;
        }
        if code.read(&mut models[valence.min(31)])? {
            caps.insert(vertex);
        }
    }
    Ok(caps)
}

/// §7.1.1: removes the caps and judges what remains. The mesh has no positions yet.
fn open(gluing: &Gluing, fans: &Fans, caps: &BTreeSet<usize>, boundary: u64) -> Result<Mesh> {
    let corners = 0..gluing.opposite.len();
    let removed = |c: usize| [c, next(c), prev(c)].iter().any(|c| caps.contains(&fans.vertex[*c]));
    let kept: Vec<usize> = corners.clone().filter(|&c| !removed(c)).collect();
    let open_edges = kept.iter().filter(|&&c| removed(gluing.opposite[c])).count() as u64;
    demand((corners.len() - kept.len()) as u64 == 3 * boundary, "7.1.1: triangles removed")?;
    demand(open_edges == boundary, "7.1.1: boundary edges")?;
    demand(gluing.starts.iter().all(|&c| !removed(c)), "7.1.1: the first triangle of a component")?;

    // Vertices that stay are numbered anew, without the tips.
    let staying: BTreeSet<usize> = kept.iter().map(|&c| fans.vertex[c]).collect();
    let numbers: Vec<usize> = staying.into_iter().collect();
    let vertex = |c: usize| numbers.binary_search(&fans.vertex[c]).expect("a vertex that stays");
    let edge = |c| (vertex(next(c)), vertex(prev(c)));

    let mut mesh = Mesh { component: vec![0; numbers.len()], ..Mesh::default() };
    let mut names = BTreeSet::new();
    for &c in kept.iter().filter(|&c| c % 3 == 0) {
        let triangle = [c, c + 1, c + 2].map(vertex);
        let [x, y, z] = triangle;
        demand(x != y && y != z && z != x, "2.2: rule 1")?;
        let edges = [(x, y), (y, z), (z, x)];
        demand(edges.iter().all(|e| !mesh.third.contains_key(e)), "2.2: rule 2 or 3")?;
        let mut name = triangle;
        name.sort_unstable();
        demand(names.insert(name), "2.2: rule 4")?;
        mesh.add(triangle);
    }
    for &c in &kept {
        let (a, b) = edge(c);
        let lone = removed(gluing.opposite[c]);
        demand(lone != mesh.third.contains_key(&(b, a)), "2.2: rule 3")?;
    }
    check_fans(&mesh)?;

    mesh.roots = gluing.starts.iter().rev().map(|&c| edge(c)).collect();
    for (i, &root) in mesh.roots.iter().enumerate() {
        let alone = Mesh { third: std::mem::take(&mut mesh.third), roots: vec![root], ..Mesh::default() };
        for v in Walk::of(&alone).vertices(&alone) {
            mesh.component[v] = i;
        }
        mesh.third = alone.third;
    }
    Ok(mesh)
}

/// Rule 5 of §2.2: as many corners as a run round the vertex meets.
fn check_fans(mesh: &Mesh) -> Result<()> {
    let mut at = vec![Vec::new(); mesh.component.len()];
    for (&(a, b), &c) in &mesh.third {
        // The triangle (a, b, c) as it lies at a: between the neighbours b and c.
        at[a].push((b, c));
    }
    for fan in at {
        let start = fan.iter().find(|(b, _)| fan.iter().all(|(_, c)| c != b)).or(fan.first());
        let Some(&(first, mut reached)) = start else { return demand(false, "2.2: rule 6") };
        let mut met = 1;
        while reached != first
            && let Some(&(_, c)) = fan.iter().find(|(b, _)| *b == reached)
        {
            reached = c;
            met += 1;
        }
        demand(met == fan.len(), "2.2: rule 5")?;
    }
    Ok(())
}

/// §7.2: lattice points, by vertex.
fn read_positions(
    code: &mut Code,
    mesh: &Mesh,
    scale: Scale,
    first: [usize; 3],
    mut other: Option<Other>,
) -> Result<Vec<[i64; 3]>> {
    let mut models = vec![Number::FRESH; 36];
    let mut cells: Vec<Option<[i64; 3]>> = vec![None; mesh.component.len()];
    let mut previous = [0; 3];
    for c in Walk::of(mesh).triangles {
        let tip = mesh.tip(c);
        for (v, of_first) in [c.0, c.1, tip].into_iter().zip(first) {
            if cells[v].is_some() {
                continue;
            }
            let beyond = mesh.opposite(c).and_then(|o| cells[mesh.tip(o)]);
            let (prediction, size, context) = match (cells[c.0], cells[c.1], beyond) {
                (Some(a), Some(b), Some(w)) if v == tip => {
                    let m = (0..3).map(|k| (a[k] - b[k]).abs()).max().unwrap_or(0);
                    ([0, 1, 2].map(|k| a[k] + b[k] - w[k]), Some(m), 1 + bit_length(m))
                }
                _ => (previous, None, of_first),
            };
            let shared = match &mut other {
                Some(other) => other.cell(code, prediction, size)?,
                None => None,
            };
            if let Some(cell) = shared {
                cells[v] = Some(cell);
                previous = cell;
                continue;
            }
            let mut cell = prediction;
            for x in &mut cell {
                *x += code.signed(&mut models[context])?;
            }
            demand(cell.iter().all(|&x| scale.holds(x)), "7.2: off the lattice")?;
            cells[v] = Some(cell);
            previous = cell;
        }
    }
    let known = cells.into_iter().flatten();
    Ok(known.map(|cell| cell.map(|x| from_cell(x, scale.shift))).collect())
}
