//! Levels with textures and normals beside those of meshoptimizer: pictures of both, and how far they are from pictures of the original.

use super::tables::{Cell, Table};
use anyhow::{Context, anyhow};
use meshopt::SimplifyOptions;
use std::collections::HashMap;
use std::io::BufWriter;
use std::path::{Path, PathBuf};
use unweld::decoder::Decoder;
use unweld::encoder::{AttributeBirth, Encoder, Options, Preview};
use unweld::formats::{ReadOptions, read_painted, sample_scene};
use unweld::mesh::attributes::{Domain, NO_VALUE, Semantic};
use unweld::mesh::{Attribute, IndexedMesh, Paint};
use unweld::render::{Model, Picture, View, render_with, write_png};

/// One row a model and share of its triangles; of the scene made by code where no files are named, of which `sheet` becomes a picture.
///
/// # Errors
/// Those of reading, of the coder and of writing.
pub fn table(files: &[PathBuf], sheet: Option<&Path>) -> anyhow::Result<Table> {
    let mut table = Table::new("Looks of levels", &[NOTE], &COLUMNS);
    if files.is_empty() {
        let scene = Textured::of("scene made by code", &sample_scene(1.0), None)?;
        let mut pairs = Vec::new();
        for share in SHARES {
            let (ours, peers) = (scene.level(share)?, scene.peers(share));
            table.rows.push(scene.row(share, &ours, &peers)?);
            pairs.push((ours, peers.into_iter().next().map(|(_, mesh)| mesh)));
        }
        if let Some(path) = sheet {
            scene.draw(&pairs, path)?;
        }
    }
    for path in files {
        let name = path.file_stem().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
        let bytes = std::fs::read(path).with_context(|| path.display().to_string())?;
        let model = Textured::of(&name, &bytes, path.parent())?;
        for share in SHARES {
            table.rows.push(model.row(share, &model.level(share)?, &model.peers(share))?);
        }
    }
    Ok(table)
}

/// A mesh with its pictures.
struct Textured {
    name: String,
    mesh: IndexedMesh,
    paint: Paint,
}

impl Textured {
    /// All that a file shows, with normals and the first texture coordinates; its pictures may lie in `folder`.
    fn of(name: &str, file: &[u8], folder: Option<&Path>) -> anyhow::Result<Self> {
        let mut options = ReadOptions::default();
        options.folder = folder.map(Path::to_owned);
        let (source, paint) = read_painted(file, &options).map_err(|e| anyhow!("{name}: {e}"))?;
        let mut mesh = source.mesh;
        let counts = |a: &Attribute| {
            a.set == 0 && matches!(a.semantic, Semantic::Normal | Semantic::TexCoord | Semantic::Part)
        };
        mesh.attributes.retain(counts);
        mesh.bodies.clear();
        Ok(Self { name: name.to_owned(), mesh, paint })
    }

    /// The base of as many vertices as make nearest to a share of the triangles, with all attributes.
    fn level(&self, share: f64) -> anyhow::Result<IndexedMesh> {
        let wanted = share * self.mesh.triangles.len() as f64;
        let mut vertices = wanted / 2.0;
        let mut best: Option<IndexedMesh> = None;
        let off = |mesh: &IndexedMesh| (mesh.triangles.len() as f64 / wanted).ln().abs();
        for _ in 0..TRIES {
            let mesh = self.base(vertices.round() as usize)?;
            let ratio = mesh.triangles.len() as f64 / wanted;
            if best.as_ref().is_none_or(|best| off(&mesh) < off(best)) {
                best = Some(mesh);
            }
            if (ratio - 1.0).abs() < 0.004 {
                break;
            }
            vertices /= ratio;
        }
        best.context("no level")
    }

    fn base(&self, vertices: usize) -> anyhow::Result<IndexedMesh> {
        let mut options = Options::default();
        (options.preview, options.lifting, options.position_bits) = (Preview::Off, Some(0), 18);
        options.simplify.base_vertices = Some(vertices);
        let all = self.mesh.attributes.iter().map(Attribute::title);
        options.attribute_births = all.map(|name| (name, AttributeBirth::Base)).collect();
        let file = Encoder::new(options).encode_to_vec(&self.mesh)?;
        let mut decoder = Decoder::new(unweld::decoder::Options::default());
        decoder.push(&file);
        while decoder.level().is_none() {
            decoder.poll()?.context("the file ends before its base")?;
        }
        Ok(decoder.assembled()?)
    }

    /// What `meshopt_simplifyWithAttributes` makes of it, each part on its own, and the same with `Permissive`; those that reach the number of
    /// triangles within 2 %.
    fn peers(&self, share: f64) -> Vec<(&'static str, IndexedMesh)> {
        let modes = [("attributes", SimplifyOptions::None), ("permissive", SimplifyOptions::Permissive)];
        let of = |(name, flags)| (name, self.peer(share, flags));
        let wanted = share * self.mesh.triangles.len() as f64;
        let reaches = |mesh: &IndexedMesh| mesh.triangles.len() as f64 <= 1.02 * wanted;
        modes.map(of).into_iter().filter(|(_, mesh)| reaches(mesh)).collect()
    }

    fn peer(&self, share: f64, flags: SimplifyOptions) -> IndexedMesh {
        let part = self.mesh.attributes.iter().find(|a| a.semantic == Semantic::Part);
        let mut parts: HashMap<u32, Vec<usize>> = HashMap::new();
        for t in 0..self.mesh.triangles.len() {
            parts.entry(part.map_or(0, |part| part.corners[t])).or_default().push(t);
        }
        let mut numbers: Vec<u32> = parts.keys().copied().collect();
        numbers.sort_unstable();
        let mut made = IndexedMesh::new(self.mesh.positions.clone(), Vec::new());
        made.attributes =
            self.mesh.attributes.iter().map(|a| Attribute { corners: Vec::new(), ..a.clone() }).collect();
        numbers.iter().for_each(|part| self.simplify_part(&parts[part], share, flags, &mut made));
        made
    }

    /// Appends what is made of some triangles.
    fn simplify_part(&self, triangles: &[usize], share: f64, flags: SimplifyOptions, made: &mut IndexedMesh) {
        // A vertex of the peer's: a corner of ours, all of whose values it has.
        let at_corners: Vec<&Attribute> =
            self.mesh.attributes.iter().filter(|a| a.domain == Domain::Corner).collect();
        let mut places = HashMap::new();
        let (mut corners, mut indices) = (Vec::new(), Vec::new());
        for corner in triangles.iter().flat_map(|t| [3 * t, 3 * t + 1, 3 * t + 2]) {
            let position = self.mesh.positions[self.mesh.triangles[corner / 3][corner % 3] as usize];
            let values = at_corners.iter().flat_map(|a| numbers(a, corner));
            let key: Vec<u32> =
                position.into_iter().map(|x| x as f32).chain(values).map(f32::to_bits).collect();
            let next = corners.len() as u32;
            let place = *places.entry(key).or_insert(next);
            if place == next {
                corners.push(corner);
            }
            indices.push(place);
        }
        let positions: Vec<[f32; 3]> = corners
            .iter()
            .map(|c| self.mesh.positions[self.mesh.triangles[c / 3][c % 3] as usize].map(|x| x as f32))
            .collect();
        let weights: Vec<f32> = at_corners
            .iter()
            .flat_map(|a| vec![if a.semantic == Semantic::Normal { 0.5 } else { 1.0 }; a.components])
            .collect();
        let values: Vec<f32> =
            corners.iter().flat_map(|&c| at_corners.iter().flat_map(move |a| numbers(a, c))).collect();
        let target = (triangles.len() as f64 * share) as usize * 3;
        let unlocked = vec![false; positions.len()];
        let left = meshopt::simplify_with_attributes_and_locks_decoder(
            &indices,
            &positions,
            &values,
            &weights,
            weights.len() * size_of::<f32>(),
            &unlocked,
            target,
            1.0,
            flags,
            None,
        );
        for t in left.as_chunks::<3>().0 {
            let t = t.map(|place| corners[place as usize]);
            made.triangles.push(t.map(|c| self.mesh.triangles[c / 3][c % 3]));
            for (of, to) in self.mesh.attributes.iter().zip(&mut made.attributes) {
                match of.domain {
                    Domain::Corner => to.corners.extend(t.map(|c| of.corners[c])),
                    Domain::Triangle => to.corners.push(of.corners[t[0] / 3]),
                }
            }
        }
    }

    fn row(
        &self,
        share: f64,
        ours: &IndexedMesh,
        peers: &[(&str, IndexedMesh)],
    ) -> anyhow::Result<Vec<Cell>> {
        let own = self.psnr(ours)?;
        let mut best: Option<(f64, &str, usize)> = None;
        for (name, mesh) in peers {
            let psnr = self.psnr(mesh)?;
            if best.is_none_or(|(most, ..)| psnr > most) {
                best = Some((psnr, name, mesh.triangles.len()));
            }
        }
        let wanted = share * self.mesh.triangles.len() as f64;
        let reached = (ours.triangles.len() as f64) <= 1.02 * wanted;
        Ok(vec![
            Cell::text(&self.name),
            Cell::text(format!("{:.0} %", 100.0 * share)),
            Cell::Count(wanted as u64),
            Cell::Count(ours.triangles.len() as u64),
            Cell::number(Some(own), 2),
            best.map_or(Cell::None, |(.., triangles)| Cell::Count(triangles as u64)),
            best.map_or(Cell::None, |(_, name, _)| Cell::text(name)),
            Cell::number(best.map(|(psnr, ..)| psnr), 2),
            Cell::number(best.filter(|_| reached).map(|(psnr, ..)| own - psnr), 2),
        ])
    }

    fn model<'a>(&'a self, mesh: &'a IndexedMesh) -> Model<'a> {
        Model { mesh, paint: Some(&self.paint) }
    }

    /// Mean over 12 directions, in dB, of the pixels that either covers.
    fn psnr(&self, mesh: &IndexedMesh) -> anyhow::Result<f64> {
        let mut sum = 0.0;
        // The vertices of an icosahedron.
        let directions = [(0.0, 90.0), (0.0, -90.0)].into_iter();
        let lower = (0..5).map(|k| (72.0 * f64::from(k), LATITUDE));
        let upper = (0..5).map(|k| (72.0 * f64::from(k) + 36.0, -LATITUDE));
        let directions: Vec<(f64, f64)> = directions.chain(lower).chain(upper).collect();
        for &(turn_degrees, tilt_degrees) in &directions {
            let view = View {
                width: 2 * SIDE,
                height: SIDE,
                turn_degrees,
                tilt_degrees,
                background: None,
                ..View::default()
            };
            sum += apart(&render_with(&[self.model(&self.mesh), self.model(mesh)], &view, &|_, _| ())?);
        }
        Ok(sum / directions.len() as f64)
    }

    /// A picture of all of ours, and below of the peer's; the original before them.
    fn draw(&self, pairs: &[(IndexedMesh, Option<IndexedMesh>)], path: &Path) -> anyhow::Result<()> {
        let rows = [
            pairs.iter().map(|(ours, _)| ours).collect::<Vec<_>>(),
            pairs.iter().filter_map(|(_, peer)| peer.as_ref()).collect(),
        ];
        let mut sheet: Option<Picture> = None;
        for row in rows {
            let models: Vec<Model> =
                [&self.mesh].into_iter().chain(row).map(|mesh| self.model(mesh)).collect();
            let view = View {
                width: PANE * models.len() as u32,
                height: PANE * 3 / 4,
                turn_degrees: 20.0,
                tilt_degrees: 20.0,
                ..View::default()
            };
            let picture = render_with(&models, &view, &|_, _| ())?;
            match &mut sheet {
                None => sheet = Some(picture),
                Some(sheet) => {
                    anyhow::ensure!(sheet.width == picture.width, "the peer does not reach all shares");
                    sheet.height += picture.height;
                    sheet.pixels.extend(picture.pixels);
                }
            }
        }
        let file = std::fs::File::create(path).with_context(|| path.display().to_string())?;
        write_png(&sheet.context("nothing to draw")?, &mut BufWriter::new(file))?;
        Ok(())
    }
}

/// The numbers of a corner; 0 where it has none.
fn numbers(attribute: &Attribute, corner: usize) -> impl Iterator<Item = f32> + '_ {
    let value = attribute.corners[corner];
    let number = move |k: usize| match value {
        NO_VALUE => 0.0,
        value => attribute.values.number(value as usize * attribute.components + k) as f32,
    };
    (0..attribute.components).map(number)
}

/// The peak signal-to-noise ratio between the left and the right half of a picture without a background, in dB.
fn apart(picture: &Picture) -> f64 {
    let (mut sum, mut count) = (0.0, 0u64);
    let width = picture.width as usize;
    for row in picture.pixels.chunks_exact(width) {
        for (a, b) in row[..width / 2].iter().zip(&row[width / 2..]) {
            if a[3] == 0 && b[3] == 0 {
                continue;
            }
            count += 3;
            // Over a middle grey, as what is not covered is.
            let over = |p: &[u8; 4], k: usize| {
                let share = f64::from(p[3]) / 255.0;
                f64::from(p[k]) * share + 115.0 * (1.0 - share)
            };
            sum += (0..3).map(|k| (over(a, k) - over(b, k)).powi(2)).sum::<f64>();
        }
    }
    let mean = sum / count.max(1) as f64;
    if mean > 0.0 { (10.0 * (255.0f64.powi(2) / mean).log10()).min(99.0) } else { 99.0 }
}

const SHARES: [f64; 4] = [0.5, 0.25, 0.1, 0.05];
/// Bases made until one has the number of triangles.
const TRIES: usize = 6;
/// Pixels a side of what is compared.
const SIDE: u32 = 256;
/// Pixels across a pane of the sheet.
const PANE: u32 = 320;
/// Of an icosahedron's vertices beside the poles, in degrees.
const LATITUDE: f64 = 26.565;

const NOTE: &str = "Pictures of levels beside those of the original, textured and shaded, from 12 directions, 256 pixels wide: mean PSNR in dB over the \
     pixels that either covers. Ours: bases of as many vertices as make that number of triangles, all attributes from the base on, with births, without lifting and \
     preview, 18 bits a coordinate, 10 of normals, 12 of texture coordinates. Peer: meshoptimizer's `simplifyWithAttributes` and the same with `Permissive`, each \
     part on its own (weights of normals 0.5, of texture coordinates 1), the better of those that reach the number of triangles within 2 %.";

const COLUMNS: [&str; 9] = [
    "model",
    "share",
    "triangles wanted",
    "triangles",
    "PSNR",
    "peer's triangles",
    "peer",
    "its PSNR",
    "PSNR - its",
];
