//! Colours of the original, texel by texel.

use std::ops::Range;

use glam::{DVec3, Vec4, Vec4Swizzles};
use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

use super::BakeOptions;
use super::edges::Edges;
use super::layout::Layout;
use crate::error::{Error, Result};
use crate::limits::{Budget, Limits};
use crate::mesh::attributes::{Attribute, Semantic, Values};
use crate::mesh::distance::{Near, NearestPoints};
use crate::mesh::paint::coat::Coat;
use crate::mesh::paint::{Image, Material, Paint, light};
use crate::mesh::{IndexedMesh, lattice};

/// A texture of a mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct Baked {
    /// The map, in sRGB; black where no triangle lies.
    pub map: Image,
    /// Where in it each corner lies: texture coordinates, (0, 0) at the first texel of its first row, for the centres of texels.
    pub places: Attribute,
    /// Texels of texture triangles, without their gutters.
    pub texels: u64,
}

impl Baked {
    /// The paint of the mesh it is for: its places and nothing else.
    pub fn paint(&self) -> Paint {
        let material = Material { image: Some(0), cutoff: self.cutoff(), ..Material::default() };
        Paint {
            materials: vec![material],
            others: Some(0),
            images: vec![self.map.clone()],
            ..Paint::default()
        }
    }

    /// The opacity below which nothing is to be seen: 0 where all is opaque.
    pub fn cutoff(&self) -> f32 {
        if self.map.pixels.iter().all(|pixel| pixel[3] == u8::MAX) { 0.0 } else { 0.5 }
    }
}

/// Makes a texture for a simplified mesh, of the colours that the nearest points of the original have by `paint`. `progress` is told of how many
/// points of how many the colour is known, and says whether to go on.
///
/// # Errors
/// [`Error::Parameter`] where the original has no colours or lacks texture coordinates for its pictures, where a mesh has no triangle, and where there are
/// fewer texels than the triangles take; [`Error::Limit`] beyond the memory that is allowed; [`Error::Cancelled`] where `progress` said so;
/// [`Error::Io`] where the system has no threads.
pub fn bake(
    mesh: &IndexedMesh,
    original: &IndexedMesh,
    paint: &Paint,
    options: &BakeOptions,
    progress: &mut dyn FnMut(u64, u64) -> bool,
) -> Result<Baked> {
    check(mesh)?;
    check(original)?;
    let layout = Layout::new(mesh, options.texels, options.gutter)?;
    let edges = Edges::new(mesh, &layout);
    let [width, height] = layout.sides.map(|side| side as usize);
    let mut budget = Budget::new(Limits { memory: options.max_memory, work: u64::MAX });
    // The map, and once more as it is written.
    budget.take_memory(width * height, 2 * size_of::<[u8; 4]>())?;
    budget.take_memory(original.triangles.len(), BYTES_A_TRIANGLE)?;
    budget.take_memory(mesh.triangles.len(), BYTES_A_PLACE)?;
    let pixels: usize = paint.images.iter().map(|image| image.pixels.len()).sum();
    // With their halves.
    budget.take_memory(pixels, size_of::<[u16; 4]>() * 4 / 3 + 1)?;

    let source = Source::new(mesh, original, paint, options)?;
    let pool = ThreadPoolBuilder::new().num_threads(options.threads.get()).build();
    let pool = pool.map_err(|e| Error::Io(std::io::Error::other(e).into()))?;
    let texels: Vec<u64> =
        layout.places.iter().map(|place| triangle_texels(layout.edge_texels(place))).collect();
    let total = texels.iter().sum::<u64>() + (mesh.positions.len() + edges.texels()) as u64;
    let mut ticker = Ticker { done: 0, total, progress };
    let spacing = spacing(mesh, &layout);

    let mut vertices = vec![[0; 4]; mesh.positions.len()];
    let used = used(mesh);
    let of_vertices = |range: Range<usize>| {
        let mut near = Near::default();
        let colour = |v: usize| {
            if used[v] { source.colour(mesh.positions[v].into(), spacing[v], &mut near) } else { [0; 4] }
        };
        range.map(colour).collect::<Vec<_>>()
    };
    in_chunks(&pool, vertices.len(), GRAIN, of_vertices, &mut |range, colours: Vec<[u8; 4]>| {
        ticker.add(range.len() as u64)?;
        vertices[range].copy_from_slice(&colours);
        Ok(())
    })?;

    let mut along = Vec::with_capacity(edges.texels());
    let of_edges = |range: Range<usize>| {
        let (mut near, mut colours) = (Near::default(), Vec::new());
        for edge in &edges.list[range] {
            let [a, b] = edge.ends.map(|v| DVec3::from(mesh.positions[v as usize]));
            let apart = edge.ends.map(|v| spacing[v as usize]);
            for step in 0..edge.texels {
                colours.push(match step {
                    0 => vertices[edge.ends[0] as usize],
                    _ if step + 1 == edge.texels || edge.ends[0] == edge.ends[1] => {
                        vertices[edge.ends[1] as usize]
                    }
                    _ => {
                        let share = f64::from(step) / f64::from(edge.texels - 1);
                        source.colour(a.lerp(b, share), 0.5 * (apart[0] + apart[1]), &mut near)
                    }
                });
            }
        }
        colours
    };
    in_chunks(&pool, edges.list.len(), GRAIN, of_edges, &mut |_, colours| {
        ticker.add(colours.len() as u64)?;
        along.extend(colours);
        Ok(())
    })?;

    let mut map =
        Image { width: layout.sides[0], height: layout.sides[1], pixels: vec![EMPTY; width * height] };
    let of_triangles = |range: Range<usize>| {
        range.map(|t| source.triangle(mesh, t, &layout, &edges, &along)).collect::<Vec<_>>()
    };
    in_chunks(&pool, mesh.triangles.len(), GRAIN / 4, of_triangles, &mut |range, triangles| {
        ticker.add(texels[range.clone()].iter().sum())?;
        for (t, colours) in range.zip(triangles) {
            let place = &layout.places[t];
            let count = layout.edge_texels(place);
            for ([x, y], steps) in layout.half(place) {
                map.pixels[y as usize * width + x as usize] = colours[in_list(steps, count)];
            }
        }
        Ok(())
    })?;
    Ok(Baked { map, places: places(&layout), texels: texels.iter().sum() })
}

/// What there is to ask for colours.
pub(super) struct Source<'a> {
    pub coat: Coat<'a>,
    nearest: NearestPoints,
    /// The area of each triangle.
    areas: Vec<f64>,
}

impl<'a> Source<'a> {
    pub(super) fn new(
        mesh: &IndexedMesh,
        original: &'a IndexedMesh,
        paint: &'a Paint,
        options: &BakeOptions,
    ) -> Result<Self> {
        let coat = Coat::new(original, paint, glam::Vec3::ONE);
        let count = original.triangles.len();
        if (0..count).all(|t| coat.is_bare(t)) {
            return Err(Error::Parameter(
                "there is nothing to bake: the original has no colours and no texture".into(),
            ));
        }
        if let Some(t) = (0..count).find(|&t| coat.lacks_places(t)) {
            let what = format!("triangle {t} of the original has a texture, but no texture coordinates");
            return Err(Error::Parameter(what));
        }
        let none = || Error::Parameter("a mesh without a triangle has no colours".into());
        let nearest = NearestPoints::new(original, mesh, options.threads).ok_or_else(none)?;
        let areas = (0..count).map(|t| area(original, t)).collect();
        Ok(Self { coat, nearest, areas })
    }

    /// The colour, in sRGB, of the point nearest to another one, where texels are so far apart.
    fn colour(&self, p: DVec3, spacing: f64, near: &mut Near) -> [u8; 4] {
        let (colour, cutoff) = self.light(p, spacing, near);
        let [r, g, b] = light::to_srgb(colour.xyz());
        // The opacity of what is opaque means nothing.
        let opacity = if cutoff > 0.0 { (colour.w.clamp(0.0, 1.0) * 255.0).round() as u8 } else { u8::MAX };
        [r, g, b, opacity]
    }

    /// So in linear light, with the opacity below which nothing is seen.
    pub(super) fn light(&self, p: DVec3, spacing: f64, near: &mut Near) -> (Vec4, f32) {
        let found = self.nearest.nearest_from(p.to_array(), near);
        let t = found.triangle as usize;
        let painted = self.coat.of(t);
        let level = match &painted.picture {
            Some((texture, _)) if spacing > 0.0 => {
                texture.level(painted.of_picture(), self.areas[t] / (spacing * spacing))
            }
            _ => 0,
        };
        (painted.at(found.shares.map(|share| share as f32), level), painted.cutoff)
    }

    /// The colours of a triangle's texels, row by row, in the order of [`in_list`].
    fn triangle(
        &self,
        mesh: &IndexedMesh,
        t: usize,
        layout: &Layout,
        edges: &Edges,
        along: &[[u8; 4]],
    ) -> Vec<[u8; 4]> {
        let place = &layout.places[t];
        let count = layout.edge_texels(place);
        let last = count - 1;
        let right = usize::from(place.right);
        let corners = [right, (right + 1) % 3, (right + 2) % 3];
        let [a, b, c] = corners.map(|k| DVec3::from(mesh.positions[mesh.triangles[t][k] as usize]));
        let spacing = texel_length(mesh, t, count);
        let edge = |k: usize, step: u32| along[edges.texel(mesh, t, corners[k], step, count)];
        let mut near = Near::default();
        let mut colours = Vec::with_capacity(triangle_texels(count) as usize);
        for j in 0..count {
            for i in 0..count - j {
                colours.push(match (i, j) {
                    (_, 0) => edge(0, i),
                    _ if i + j == last => edge(1, j),
                    (0, _) => edge(2, last - j),
                    _ => {
                        let [u, v] = [i, j].map(|step| f64::from(step) / f64::from(last));
                        self.colour(a + (b - a) * u + (c - a) * v, spacing, &mut near)
                    }
                });
            }
        }
        colours
    }
}

/// Where a texel so many steps from the right angle is in the list of a triangle's.
fn in_list([i, j]: [u32; 2], count: u32) -> usize {
    let (i, j, count) = (i as usize, j as usize, count as usize);
    j * count - j * j.saturating_sub(1) / 2 + i
}

fn triangle_texels(count: u32) -> u64 {
    u64::from(count) * (u64::from(count) + 1) / 2
}

/// How far texels of a triangle are apart, the middle of both directions.
fn texel_length(mesh: &IndexedMesh, t: usize, count: u32) -> f64 {
    (2.0 * area(mesh, t)).sqrt() / f64::from(count - 1)
}

/// For each vertex how far texels are apart round it, where they are finest.
fn spacing(mesh: &IndexedMesh, layout: &Layout) -> Vec<f64> {
    let mut spacing = vec![f64::INFINITY; mesh.positions.len()];
    for (t, triangle) in mesh.triangles.iter().enumerate() {
        let own = texel_length(mesh, t, layout.edge_texels(&layout.places[t]));
        triangle.iter().for_each(|&v| spacing[v as usize] = spacing[v as usize].min(own));
    }
    spacing.iter_mut().filter(|x| !x.is_finite()).for_each(|x| *x = 0.0);
    spacing
}

fn area(mesh: &IndexedMesh, t: usize) -> f64 {
    let [a, b, c] = mesh.triangles[t].map(|v| DVec3::from(mesh.positions[v as usize]));
    0.5 * (b - a).cross(c - a).length()
}

fn places(layout: &Layout) -> Attribute {
    let mut values = Vec::with_capacity(6 * layout.places.len());
    for place in &layout.places {
        let last = layout.edge_texels(place) - 1;
        for corner in 0..3 {
            let steps = [[0, 0], [last, 0], [0, last]][(3 + corner - usize::from(place.right)) % 3];
            let texel = layout.texel(place, steps);
            // Exact: sides are powers of two.
            values.extend([0, 1].map(|k| (texel[k] as f32 + 0.5) / layout.sides[k] as f32));
        }
    }
    let corners = (0..3 * layout.places.len() as u32).collect();
    Attribute::new(Semantic::TexCoord, 2, Values::F32(values), corners)
}

fn used(mesh: &IndexedMesh) -> Vec<bool> {
    let mut used = vec![false; mesh.positions.len()];
    mesh.triangles.as_flattened().iter().for_each(|&v| used[v as usize] = true);
    used
}

pub(super) fn check(mesh: &IndexedMesh) -> Result<()> {
    let vertices = mesh.positions.len();
    if mesh.triangles.is_empty() {
        return Err(Error::Parameter("a mesh without a triangle has no texture".into()));
    }
    if let Some(v) = mesh.triangles.as_flattened().iter().find(|&&v| v as usize >= vertices) {
        return Err(Error::Parameter(format!("a triangle names vertex {v} of {vertices}")));
    }
    let corners = mesh.triangles.iter().flatten().map(|&v| mesh.positions[v as usize]);
    match lattice::bounds(corners) {
        Some((min, max)) if min.iter().chain(&max).all(|x| x.is_finite()) => Ok(()),
        _ => Err(Error::Parameter("a coordinate is not finite".into())),
    }
}

/// Tells of the progress.
struct Ticker<'a> {
    done: u64,
    total: u64,
    progress: &'a mut dyn FnMut(u64, u64) -> bool,
}

impl Ticker<'_> {
    fn add(&mut self, more: u64) -> Result<()> {
        self.done += more;
        if (self.progress)(self.done, self.total) { Ok(()) } else { Err(Error::Cancelled) }
    }
}

/// Calls `work` with stretches of so many numbers at a time below `count`, on all threads, and `take`, in order, with what it gives.
pub(super) fn in_chunks<T: Send>(
    pool: &ThreadPool,
    count: usize,
    grain: usize,
    work: impl Fn(Range<usize>) -> T + Sync,
    take: &mut dyn FnMut(Range<usize>, T) -> Result<()>,
) -> Result<()> {
    let range = |chunk: usize| chunk * grain..((chunk + 1) * grain).min(count);
    let chunks = count.div_ceil(grain);
    // What is waiting to be taken is little.
    for first in (0..chunks).step_by(AT_ONCE) {
        let some: Vec<usize> = (first..(first + AT_ONCE).min(chunks)).collect();
        let made: Vec<T> = pool.install(|| some.par_iter().map(|&chunk| work(range(chunk))).collect());
        some.into_iter().zip(made).try_for_each(|(chunk, made)| take(range(chunk), made))?;
    }
    Ok(())
}

/// Black.
const EMPTY: [u8; 4] = [0, 0, 0, u8::MAX];
/// Vertices or edges that a thread takes at once.
const GRAIN: usize = 256;
/// Stretches that are worked on before any is taken.
const AT_ONCE: usize = 64;
/// Bytes for a triangle of the original: in the search, and its area.
const BYTES_A_TRIANGLE: usize = 180;
/// Bytes for a triangle of the mesh: its place, edges with their texels, corners of the map.
const BYTES_A_PLACE: usize = 400;
