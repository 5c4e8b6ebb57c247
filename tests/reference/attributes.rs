//! Chapters 13.1 to 13.3, 13.6 and 13.7: the values of attributes at level 0.

use std::collections::BTreeMap;

use super::attribute::Attribute;
use super::container::{ATTRIBUTES, File, Result, demand};
use super::entropy::{Code, Model, Number};
use super::expected::Values;
use super::residue::{Origins, Whole};
use super::walk::{Edge, Mesh, Walk};

/// Of a corner, for each attribute: the bits of its numbers, where it has a value.
pub type Numbers = Vec<Option<Vec<u64>>>;

/// The wedges of level 0 as far as they are numbered.
#[derive(Default)]
pub struct Wedges {
    pub of: BTreeMap<Edge, usize>,
    count: usize,
}

/// An attribute while it is read.
pub struct Column {
    pub about: Attribute,
    same: [Model; 2],
    present: [Model; 2],
    last: bool,
    models: Values,
    /// By wedge or triangle.
    pub values: Vec<Option<Vec<i32>>>,
    pub lengths: Vec<Vec<u32>>,
}

impl Column {
    fn of(about: &Attribute) -> Self {
        Self {
            same: [Model::FRESH; 2],
            present: [Model::FRESH; 2],
            last: true,
            models: Values::fresh(about),
            about: about.clone(),
            values: vec![],
            lengths: vec![],
        }
    }

    fn is_of_triangles(&self) -> bool {
        self.about.marks % 2 == 1
    }

    /// §13.3: one more value.
    fn read(&mut self, code: &mut Code, at: &Place, p: Option<usize>) -> Result<()> {
        let nothing = vec![0; integers(&self.about)];
        let is_partial = self.about.marks / 4 % 2 == 1;
        if let Some(p) = p
            && code.read(&mut self.same[usize::from(is_partial && !self.last)])?
        {
            self.values.push(self.values[p].clone());
            self.lengths.push(nothing);
            return Ok(());
        }
        if is_partial {
            self.last = code.read(&mut self.present[usize::from(self.last)])?;
            if !self.last {
                self.values.push(None);
                self.lengths.push(nothing);
                return Ok(());
            }
        }
        let (value, lengths) = self.models.read(code, at, p, &self.about, &self.values, &self.lengths)?;
        self.values.push(Some(value));
        self.lengths.push(lengths);
        Ok(())
    }
}

/// Where a value is.
pub struct Place<'a> {
    pub mesh: &'a Mesh,
    pub wedges: &'a Wedges,
    pub corners: &'a [Edge],
}

/// §13.1.
pub fn integers(about: &Attribute) -> usize {
    match about.quantisation {
        2 => about.components - 1,
        3 if about.stored == 7 => 2 * about.components,
        _ => about.components,
    }
}

/// §13.2: the radius of octahedral coordinates.
pub fn radius(about: &Attribute) -> i64 {
    (1 << (about.bits - 1)) - 1
}

/// §13.2: the direction of octahedral coordinates.
pub fn direction(u: i64, v: i64, r: i64) -> [f64; 3] {
    let sign = |x: i64| if x < 0 { -1 } else { 1 };
    let (u, v) = (u.clamp(-r, r), v.clamp(-r, r));
    let w = r - u.abs() - v.abs();
    let (u, v) = if w < 0 { (sign(u) * (r - v.abs()), sign(v) * (r - u.abs())) } else { (u, v) };
    let [x, y, z] = [u, v, w].map(|x| x as f64);
    let length = ((x * x + y * y) + z * z).sqrt();
    [x / length, y / length, z / length]
}

/// §13.2: the bits of the number that raw integers are.
pub fn raw32(q: i32) -> u32 {
    if q < 0 { q as u32 ^ 0x7FFF_FFFF } else { q as u32 }
}

pub fn raw64([high, low]: [i32; 2]) -> u64 {
    let q = u64::from(high as u32) << 32 | u64::from(low as u32);
    if high < 0 { q ^ (u64::MAX >> 1) } else { q }
}

/// §13.2: the bits of the numbers of a value.
fn numbers(about: &Attribute, q: &[i32]) -> Vec<u64> {
    let real = |x: f64| if about.stored == 6 { u64::from((x as f32).to_bits()) } else { x.to_bits() };
    let low = [0xFF, 0xFFFF, u32::MAX];
    match about.quantisation {
        0 => q.iter().map(|&q| u64::from(q as u32 & low[usize::from(about.stored) / 2])).collect(),
        1 => (0..q.len()).map(|k| real(about.origin[k] + about.step * f64::from(q[k]))).collect(),
        2 => {
            let mut all = direction(q[0].into(), q[1].into(), radius(about)).to_vec();
            if let Some(&side) = q.get(2) {
                all.push(if side > 0 { -1.0 } else { 1.0 });
            }
            all.into_iter().map(real).collect()
        }
        _ if about.stored == 7 => q.chunks(2).map(|q| raw64([q[0], q[1]])).collect(),
        _ => q.iter().map(|&q| raw32(q).into()).collect(),
    }
}

/// Gives the triangles of a whole the values of their corners.
pub fn give_values(file: &File, mesh: &Mesh, whole: &mut Whole, origins: &Origins) -> Result<()> {
    if file.attributes.is_empty() {
        return Ok(());
    }
    let payload = file.payload(ATTRIBUTES, 0);
    let told = file.attributes.iter().filter(|about| about.constant.is_none());
    let mut columns: Vec<Column> = told.map(Column::of).collect();
    // Constants alone have no payload.
    let mut code = Code::start(if columns.is_empty() { &[0] } else { &payload });
    let walk = Walk::of(mesh);
    let mut wedges = Wedges::default();
    let mut further = vec![];
    if columns.iter().any(|column| !column.is_of_triangles()) {
        read_vertices(&mut code, mesh, &walk, &mut columns, &mut wedges)?;
        further = read_further(&mut code, mesh, &walk, &mut columns, &mut wedges, whole, origins)?;
    }
    for column in columns.iter_mut().filter(|column| column.is_of_triangles()) {
        read_triangles(&mut code, mesh, &walk, column, whole.triangles.len())?;
    }
    if !columns.is_empty() {
        code.end()?;
    }
    whole.values = (0..whole.triangles.len())
        .map(|t| {
            let corners = walk.triangles.get(t).map(|&c| match origins.turned[t] {
                false => [c, mesh.next(c), mesh.prev(c)],
                true => [c, mesh.prev(c), mesh.next(c)],
            });
            [0, 1, 2].map(|k| {
                let value = |column: &Column| {
                    let at = match corners {
                        _ if column.is_of_triangles() => t,
                        Some(corners) => wedges.of[&corners[k]],
                        None => further[t - walk.triangles.len()][k],
                    };
                    column.values[at].as_ref().map(|value| numbers(&column.about, value))
                };
                let mut told = columns.iter();
                let every = file.attributes.iter().map(|about| match &about.constant {
                    Some(constant) => Some(numbers(about, constant)),
                    None => told.next().and_then(value),
                });
                every.collect()
            })
        })
        .collect();
    Ok(())
}

/// A wedge's values, and then its number.
fn read_wedge(
    code: &mut Code,
    mesh: &Mesh,
    columns: &mut [Column],
    wedges: &mut Wedges,
    corners: &[Edge],
    p: Option<usize>,
) -> Result<usize> {
    for column in columns.iter_mut().filter(|column| !column.is_of_triangles()) {
        column.read(code, &Place { mesh, wedges, corners }, p)?;
    }
    wedges.of.extend(corners.iter().map(|&c| (c, wedges.count)));
    wedges.count += 1;
    Ok(wedges.count - 1)
}

fn read_vertices(
    code: &mut Code,
    mesh: &Mesh,
    walk: &Walk,
    columns: &mut [Column],
    wedges: &mut Wedges,
) -> Result<()> {
    let mut broken = [Model::FRESH; 3];
    let mut breaks = [[Model::FRESH; 3]; 3];
    let listed = listed(mesh, walk);
    for v in walk.vertices(mesh) {
        let corners = fan(mesh, &listed[v]);
        let k = corners.len();
        let is_boundary = mesh.opposite(mesh.prev(corners[0])).is_none();
        let spokes = usize::from(is_boundary)..k;
        let far = |i: usize| {
            let ends = [mesh.prev(corners[(i + k - 1) % k]), mesh.next(corners[i])];
            match ends.map(|c| wedges.of.get(&c)) {
                [Some(x), Some(y)] => 1 + usize::from(x != y),
                _ => 0,
            }
        };
        let parted = spokes.clone().filter(|&i| far(i) == 2).count();
        let mut b = vec![false; k];
        if code.read(&mut broken[parted.min(2)])? {
            for i in spokes {
                let bend = bend(mesh, mesh.next(corners[(i + k - 1) % k]), mesh.prev(corners[i]));
                b[i] = code.read(&mut breaks[far(i)][bend])?;
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
        let mut p = None;
        for run in runs {
            p = Some(read_wedge(code, mesh, columns, wedges, &run, p)?);
        }
    }
    Ok(())
}

/// §13.3: the corners at a vertex.
/// For each vertex its corners as the walk comes to them.
fn listed(mesh: &Mesh, walk: &Walk) -> Vec<Vec<Edge>> {
    let mut listed = vec![vec![]; mesh.points.len()];
    for c in walk.triangles.iter().flat_map(|&c| [mesh.next(c), mesh.prev(c), c]) {
        listed[mesh.tip(c)].push(c);
    }
    listed
}

/// The corners round a vertex, of its corners as they are listed.
fn fan(mesh: &Mesh, at: &[Edge]) -> Vec<Edge> {
    let leaves = |&&c: &&Edge| mesh.opposite(mesh.prev(c)).is_none();
    let first = *at.iter().find(leaves).unwrap_or(&at[0]);
    let mut corners = vec![first];
    while let Some(o) = mesh.opposite(mesh.next(corners[corners.len() - 1])) {
        if mesh.next(o) == first {
            break;
        }
        corners.push(mesh.next(o));
    }
    corners
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

pub fn minus(x: [f64; 3], y: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|k| x[k] - y[k])
}

/// §9.2, in binary64.
pub fn dot(x: [f64; 3], y: [f64; 3]) -> f64 {
    (x[0] * y[0] + x[1] * y[1]) + x[2] * y[2]
}

pub fn cross([x0, x1, x2]: [f64; 3], [y0, y1, y2]: [f64; 3]) -> [f64; 3] {
    [x1 * y2 - x2 * y1, x2 * y0 - x0 * y2, x0 * y1 - x1 * y0]
}

/// §13.6: the wedges of the further triangles.
fn read_further(
    code: &mut Code,
    mesh: &Mesh,
    walk: &Walk,
    columns: &mut [Column],
    wedges: &mut Wedges,
    whole: &Whole,
    origins: &Origins,
) -> Result<Vec<[usize; 3]>> {
    // The vertices of the whole that those of the walk are.
    let mut named = BTreeMap::new();
    for (t, corners) in origins.corners.iter().enumerate() {
        named.extend((0..3).map(|k| (corners[k], whole.triangles[t][k])));
    }
    let mut lists: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    let listed = listed(mesh, walk);
    for v in walk.vertices(mesh) {
        let mut here: Vec<usize> = fan(mesh, &listed[v]).iter().map(|c| wedges.of[c]).collect();
        here.sort_unstable();
        here.dedup();
        lists.entry(named[&v]).or_default().extend(here);
    }
    let mut number = Number::FRESH;
    let mut further = vec![];
    for triangle in &whole.triangles[walk.triangles.len()..] {
        let mut of = [0; 3];
        for (wedge, v) in of.iter_mut().zip(triangle) {
            let list = lists.entry(*v).or_default();
            let k = if list.is_empty() { 0 } else { code.unsigned(&mut number)? as usize };
            demand(k <= list.len(), "13.6: no such wedge")?;
            *wedge = if k > 0 {
                list[k - 1]
            } else {
                let p = list.last().copied().or(wedges.count.checked_sub(1));
                let new = read_wedge(code, mesh, columns, wedges, &[], p)?;
                list.push(new);
                new
            };
        }
        further.push(of);
    }
    Ok(further)
}

/// §13.7.
fn read_triangles(
    code: &mut Code,
    mesh: &Mesh,
    walk: &Walk,
    column: &mut Column,
    count: usize,
) -> Result<()> {
    let name = |c: Edge| {
        let mut name = mesh.triangle(c);
        name.sort_unstable();
        name
    };
    let mut coded = BTreeMap::new();
    for t in 0..count {
        let c = walk.triangles.get(t).copied();
        let behind = c.and_then(|c| mesh.opposite(c)).and_then(|o| coded.get(&name(o)).copied());
        let place = Place { mesh, wedges: &Wedges::default(), corners: &[] };
        column.read(code, &place, behind.or(t.checked_sub(1)))?;
        coded.extend(c.map(|c| (name(c), t)));
    }
    Ok(())
}
