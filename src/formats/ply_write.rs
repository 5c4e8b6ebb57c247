//! Writes PLY.

use std::collections::{HashMap, HashSet};
use std::io::{self, BufWriter, Write};

use byteorder::{LittleEndian, WriteBytesExt};

use crate::mesh::IndexedMesh;
use crate::mesh::attributes::{Attribute, Domain, NO_VALUE, Semantic, Stored};

use super::Precision;
use super::ply_columns::KNOWN;
use super::write::{check, finite, in_line, is_picture, of_vertices};

/// Writes a binary little-endian PLY file, indices as `list uchar int`.
///
/// Attributes are columns of `vertex` where each vertex has one value, and of `face` where triangles have them, in the types that they are stored
/// in. Where only texture coordinates differ at a vertex, they are a list `texcoord` of each face, as MeshLab has them; where
/// others do, the vertex is written as often as its corners differ in anything, the further ones behind all others. A part is
/// `texnumber` where a library is a picture, else `material_index`. Where there is no value, a number is NaN, an integer 0, a part -1.
/// [`unwritten`](super::unwritten) tells what is not kept.
///
/// # Errors
/// What `out` says; [`io::ErrorKind::InvalidInput`] where a coordinate is not finite in the wanted precision, or the attributes are
/// not those of the mesh.
pub fn write_ply(mesh: &IndexedMesh, precision: Precision, out: &mut impl Write) -> io::Result<()> {
    check(mesh)?;
    let layout = Layout::new(mesh);
    let mut out = BufWriter::new(out);
    layout.write_header(mesh, precision, &mut out)?;
    for (row, &v) in layout.rows.iter().enumerate() {
        for &x in &mesh.positions[v as usize] {
            match precision {
                Precision::Float32 => {
                    finite(f64::from(x as f32), x)?;
                    out.write_f32::<LittleEndian>(x as f32)?;
                }
                Precision::Float64 => out.write_f64::<LittleEndian>(finite(x, x)?)?,
            }
        }
        for (attribute, of) in &layout.vertex {
            write_value(&mut out, attribute, of[row])?;
        }
    }
    for (t, triangle) in mesh.triangles.iter().enumerate() {
        let corners = layout.split.as_ref().map_or(*triangle, |split| split[t]);
        let mut face = [3; 13];
        for (bytes, v) in face[1..].chunks_exact_mut(4).zip(corners) {
            bytes.copy_from_slice(&v.to_le_bytes());
        }
        out.write_all(&face)?;
        if let Some(uv) = layout.texcoord {
            let corners = &uv.corners[3 * t..3 * t + 3];
            let any = corners.iter().any(|&value| value != NO_VALUE);
            out.write_u8(if any { 6 } else { 0 })?;
            corners.iter().filter(|_| any).try_for_each(|&value| write_value(&mut out, uv, value))?;
        }
        for attribute in &layout.face {
            write_value(&mut out, attribute, attribute.corners[t])?;
        }
    }
    out.flush()
}

/// Where things go.
struct Layout<'a> {
    /// Columns of `vertex`, and the value of each row.
    vertex: Vec<(&'a Attribute, Vec<u32>)>,
    /// The vertex of each row.
    rows: Vec<u32>,
    /// The rows of each triangle, where they are not its vertices.
    split: Option<Vec<[u32; 3]>>,
    /// Texture coordinates as a list of each face.
    texcoord: Option<&'a Attribute>,
    /// Columns of `face`.
    face: Vec<&'a Attribute>,
}

impl<'a> Layout<'a> {
    fn new(mesh: &'a IndexedMesh) -> Self {
        let (corners, face): (Vec<&Attribute>, Vec<&Attribute>) =
            mesh.attributes.iter().partition(|a| a.domain == Domain::Corner);
        let of: Vec<Option<Vec<u32>>> = corners.iter().map(|a| of_vertices(a, mesh)).collect();
        let differ: Vec<&Attribute> =
            corners.iter().zip(&of).filter(|(_, of)| of.is_none()).map(|(a, _)| *a).collect();
        let rows = (0..mesh.positions.len() as u32).collect();
        let is_list = |a: &Attribute| {
            a.semantic == Semantic::TexCoord && a.components == 2 && a.values.stored().is_float()
        };
        let texcoord = match differ[..] {
            [] => None,
            [uv] if is_list(uv) => Some(uv),
            _ => return Self { face, ..Self::split(mesh, &corners) },
        };
        let vertex = corners.into_iter().zip(of).filter_map(|(a, of)| Some((a, of?))).collect();
        Self { vertex, rows, split: None, texcoord, face }
    }

    /// A row for each vertex and for all its corners that have the same values; the first of a vertex has its number.
    fn split(mesh: &IndexedMesh, corners: &[&'a Attribute]) -> Self {
        let ones: Vec<Vec<u32>> = corners.iter().map(|a| first_equals(a)).collect();
        let vertices = mesh.positions.len();
        let mut rows: Vec<u32> = (0..vertices as u32).collect();
        let mut of = vec![vec![NO_VALUE; vertices]; corners.len()];
        let mut taken = vec![false; vertices];
        let mut known: HashMap<(u32, Vec<u32>), u32> = HashMap::new();
        let mut split = mesh.triangles.clone();
        for (corner, row) in split.as_flattened_mut().iter_mut().enumerate() {
            let v = *row;
            let one = |(a, ones): (&&Attribute, &Vec<u32>)| {
                ones.get(a.corners[corner] as usize).copied().unwrap_or(NO_VALUE)
            };
            let values: Vec<u32> = corners.iter().zip(&ones).map(one).collect();
            *row = *known.entry((v, values)).or_insert_with_key(|(_, values)| {
                let row = if std::mem::replace(&mut taken[v as usize], true) {
                    rows.push(v);
                    of.iter_mut().for_each(|of| of.push(NO_VALUE));
                    rows.len() - 1
                } else {
                    v as usize
                };
                of.iter_mut().zip(values).for_each(|(of, &value)| of[row] = value);
                row as u32
            });
        }
        let vertex = corners.iter().copied().zip(of).collect();
        Self { vertex, rows, split: Some(split), texcoord: None, face: Vec::new() }
    }

    fn write_header(&self, mesh: &IndexedMesh, precision: Precision, out: &mut impl Write) -> io::Result<()> {
        let real = match precision {
            Precision::Float32 => "float",
            Precision::Float64 => "double",
        };
        writeln!(out, "ply\nformat binary_little_endian 1.0")?;
        for picture in mesh.libraries.iter().filter(|library| is_picture(library)) {
            writeln!(out, "comment TextureFile {}", in_line(picture))?;
        }
        writeln!(out, "element vertex {}", self.rows.len())?;
        writeln!(out, "property {real} x\nproperty {real} y\nproperty {real} z")?;
        let mut used = ["x", "y", "z"].map(str::to_owned).into();
        for (attribute, _) in &self.vertex {
            write_columns(out, attribute, mesh, &mut used)?;
        }
        writeln!(out, "element face {}\nproperty list uchar int vertex_indices", mesh.triangles.len())?;
        if let Some(uv) = self.texcoord {
            writeln!(out, "property list uchar {} texcoord", type_name(uv.values.stored()))?;
        }
        let mut used = ["vertex_indices", "vertex_index", "texcoord"].map(str::to_owned).into();
        for attribute in &self.face {
            write_columns(out, attribute, mesh, &mut used)?;
        }
        writeln!(out, "end_header")
    }
}

/// The first value that is the same as each, bit for bit.
fn first_equals(attribute: &Attribute) -> Vec<u32> {
    let mut known = HashMap::new();
    let bits = |value: usize| -> Vec<u64> {
        (0..attribute.components).map(|k| attribute.values.bits(value * attribute.components + k)).collect()
    };
    (0..attribute.count()).map(|value| *known.entry(bits(value)).or_insert(value as u32)).collect()
}

/// Declares the columns of an attribute, by names that none has yet.
fn write_columns(
    out: &mut impl Write,
    attribute: &Attribute,
    mesh: &IndexedMesh,
    used: &mut HashSet<String>,
) -> io::Result<()> {
    for mut name in names(attribute, mesh) {
        while !used.insert(name.clone()) {
            name.push('_');
        }
        let stored = if is_part(attribute) { Stored::I32 } else { attribute.values.stored() };
        writeln!(out, "property {} {name}", type_name(stored))?;
    }
    Ok(())
}

/// What the columns of an attribute are called: as readers know them, or by its title.
fn names(attribute: &Attribute, mesh: &IndexedMesh) -> Vec<String> {
    if is_part(attribute) {
        let textures = mesh.libraries.iter().any(|library| is_picture(library));
        return vec![if textures { "texnumber" } else { "material_index" }.to_owned()];
    }
    let known = KNOWN.iter().find(|(semantic, names, last, _)| {
        let most = names.len() + last.iter().count();
        *semantic == attribute.semantic && (names.len()..=most).contains(&attribute.components)
    });
    let suffix = match attribute.set {
        0 => Some(String::new()),
        set => (set < 10).then(|| set.to_string()),
    };
    match (known, suffix) {
        (Some((_, names, last, _)), Some(suffix)) => {
            let names = names.iter().chain(last).take(attribute.components);
            names.map(|name| format!("{name}{suffix}")).collect()
        }
        _ => {
            let plain = |c: char| if c.is_ascii_graphic() { c } else { '_' };
            let title: String = attribute.title().chars().map(plain).collect();
            match attribute.components {
                1 => vec![title],
                components => (0..components).map(|k| format!("{title}_{k}")).collect(),
            }
        }
    }
}

fn is_part(attribute: &Attribute) -> bool {
    attribute.semantic == Semantic::Part && attribute.components == 1 && !attribute.values.stored().is_float()
}

fn type_name(stored: Stored) -> &'static str {
    match stored {
        Stored::U8 => "uchar",
        Stored::I8 => "char",
        Stored::U16 => "ushort",
        Stored::I16 => "short",
        Stored::U32 => "uint",
        Stored::I32 => "int",
        Stored::F32 => "float",
        Stored::F64 => "double",
    }
}

/// Writes the numbers of a value.
fn write_value(out: &mut impl Write, attribute: &Attribute, value: u32) -> io::Result<()> {
    let (stored, components) = (attribute.values.stored(), attribute.components);
    let size = match stored {
        _ if is_part(attribute) => {
            let none = || u64::from(u32::MAX);
            let part = if value == NO_VALUE { none() } else { attribute.values.bits(value as usize) };
            return out.write_all(&(part as u32).to_le_bytes());
        }
        Stored::U8 | Stored::I8 => 1,
        Stored::U16 | Stored::I16 => 2,
        Stored::U32 | Stored::I32 | Stored::F32 => 4,
        Stored::F64 => 8,
    };
    for k in 0..components {
        let bits = match stored {
            _ if value != NO_VALUE => attribute.values.bits(value as usize * components + k),
            Stored::F32 => f32::NAN.to_bits().into(),
            Stored::F64 => f64::NAN.to_bits(),
            _ => 0,
        };
        out.write_all(&bits.to_le_bytes()[..size])?;
    }
    Ok(())
}

/// See [`unwritten`](super::unwritten).
pub(super) fn unwritten(mesh: &IndexedMesh) -> Vec<String> {
    let mut lost = Vec::new();
    let layout = Layout::new(mesh);
    let more = layout.rows.len() - mesh.positions.len();
    if more > 0 {
        lost.push(format!(
            "PLY has one value a vertex: {more} vertices written once more for their corners that differ"
        ));
    }
    let partial = |a: &&Attribute| !is_part(a) && a.corners.contains(&NO_VALUE);
    let partial: Vec<String> = mesh.attributes.iter().filter(partial).map(Attribute::title).collect();
    if !partial.is_empty() {
        lost.push(format!("PLY has values everywhere: NaN or 0 where there is no {}", partial.join(", ")));
    }
    if !mesh.part_names.is_empty() {
        lost.push(format!("PLY has no place for names of parts ({})", mesh.part_names.len()));
    }
    let libraries = mesh.libraries.iter().filter(|library| !is_picture(library)).count();
    if libraries > 0 {
        lost.push(format!("PLY has no place for material libraries ({libraries})"));
    }
    lost
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::{Source, read_bytes};
    use crate::mesh::attributes::Values;

    fn square() -> IndexedMesh {
        let positions = vec![[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
        IndexedMesh::new(positions, vec![[0, 1, 2], [0, 2, 3]])
    }

    fn back(mesh: &IndexedMesh) -> (String, Source) {
        let mut bytes = Vec::new();
        write_ply(mesh, Precision::Float32, &mut bytes).unwrap();
        let end = bytes.windows(11).position(|window| window == b"end_header\n").unwrap();
        let header = String::from_utf8(bytes[..end].to_vec()).unwrap();
        (header, read_bytes(&bytes, None, "").unwrap())
    }

    #[test]
    fn what_is_read_is_written() {
        let vertices = vec![0, 1, 2, 0, 2, 3];
        let mut mesh = square();
        let at =
            |semantic, components, values| Attribute::new(semantic, components, values, vertices.clone());
        let triangles = |attribute| Attribute { domain: Domain::Triangle, corners: vec![0, 1], ..attribute };
        let floats = |n: u8| Values::F32((0..n).map(|k| f32::from(k) / 8.0).collect());
        mesh.attributes = vec![
            at(Semantic::Normal, 3, floats(12)),
            at(Semantic::Tangent, 4, Values::F64(vec![-0.5; 16])),
            at(Semantic::TexCoord, 2, floats(8)),
            Attribute { set: 1, ..at(Semantic::TexCoord, 2, Values::F64(vec![f64::INFINITY; 8])) },
            Attribute { normalised: true, ..at(Semantic::Color, 4, Values::U8((0..16).collect())) },
            Attribute { name: "quality".into(), ..at(Semantic::Generic, 1, Values::I8(vec![-1, 2, -3, 4])) },
            Attribute {
                normalised: true,
                ..triangles(at(Semantic::Color, 3, Values::U16(vec![1, 2, 3, 4, 5, 6])))
            },
            triangles(at(Semantic::Part, 1, Values::U32(vec![7, 2]))),
            Attribute {
                name: "flags".into(),
                ..triangles(at(Semantic::Generic, 1, Values::U32(vec![u32::MAX, 1])))
            },
        ];
        mesh.libraries = vec!["a b.png".into()];
        let (header, source) = back(&mesh);
        assert_eq!(source.mesh, mesh);
        assert_eq!((source.dropped.len(), unwritten(&mesh).len()), (0, 0));
        for line in [
            "comment TextureFile a b.png\n",
            "property float nx\n",
            "property double t1\n",
            "property uchar alpha\n",
            "property ushort green\n",
            "property int texnumber\n",
            "property uint flags\n",
        ] {
            assert!(header.contains(line), "{line}{header}");
        }
    }

    #[test]
    fn texture_coordinates_that_differ_are_lists_of_faces() {
        let mut mesh = square();
        let values = Values::F64((0..8).map(f64::from).collect());
        mesh.attributes = vec![
            Attribute::new(Semantic::TexCoord, 2, values.clone(), vec![0, 1, 2, 3, 2, 1]),
            Attribute::new(Semantic::Generic, 1, Values::U8(vec![1, 2, 3, 4]), vec![0, 1, 2, 0, 2, 3]),
        ];
        mesh.attributes[1].name = "smoothing group".into();
        let (header, source) = back(&mesh);
        assert!(
            header.contains("property list uchar double texcoord\n")
                && header.contains("property uchar smoothing_group\n")
        );
        assert_eq!(
            (source.mesh.positions, source.mesh.triangles),
            (mesh.positions.clone(), mesh.triangles.clone())
        );
        let uv = &source.mesh.attributes[1];
        let numbers = |a: &Attribute, corner: usize| {
            [0, 1].map(|k| a.values.number(2 * a.corners[corner] as usize + k))
        };
        assert!((0..6).all(|corner| numbers(uv, corner) == numbers(&mesh.attributes[0], corner)), "{uv:?}");
        // A triangle without any has an empty list.
        mesh.attributes[0].corners[3..].fill(NO_VALUE);
        let (_, source) = back(&mesh);
        assert_eq!(source.mesh.attributes[1].corners, [0, 1, 2, NO_VALUE, NO_VALUE, NO_VALUE]);
        assert_eq!(unwritten(&mesh), ["PLY has values everywhere: NaN or 0 where there is no uv"]);
    }

    #[test]
    fn vertices_that_differ_in_other_ways_are_split() {
        let mut mesh = square();
        // Normals of a crease along 0-2, one of them told twice; texture coordinates that differ at 2.
        let normals = Values::F32(vec![0.0, 0.0, 1.0, 0.6, 0.0, 0.8, 0.0, 0.0, 1.0]);
        mesh.attributes = vec![
            Attribute::new(Semantic::Normal, 3, normals, vec![0, 2, 0, 1, 1, 1]),
            Attribute::new(
                Semantic::TexCoord,
                2,
                Values::F32(vec![0.0, 0.0, 1.0, 1.0]),
                vec![0, 0, 0, 0, 1, NO_VALUE],
            ),
        ];
        let (_, source) = back(&mesh);
        assert_eq!(source.mesh.triangles, [[0, 1, 2], [4, 5, 3]]);
        assert_eq!(source.mesh.positions[4..], [mesh.positions[0], mesh.positions[2]]);
        let [normal, uv] = &source.mesh.attributes[..] else { panic!() };
        let z = |corner: usize| normal.values.number(3 * normal.corners[corner] as usize + 2);
        assert_eq!(
            [0, 1, 2, 3, 4, 5].map(|corner| z(corner) == 1.0),
            [true, true, true, false, false, false]
        );
        let Values::F32(list) = &uv.values else { panic!() };
        let told = |corner: usize| list[2 * uv.corners[corner] as usize];
        assert_eq!([0, 1, 2, 3, 4].map(told), [0.0, 0.0, 0.0, 0.0, 1.0]);
        assert!(told(5).is_nan());
        let more = "PLY has one value a vertex: 2 vertices written once more for their corners that differ";
        assert_eq!(unwritten(&mesh), [more, "PLY has values everywhere: NaN or 0 where there is no uv"]);
    }

    #[test]
    fn names_are_words_and_told_once() {
        let mut mesh = square();
        let numbers = Attribute::new(Semantic::Generic, 2, Values::U8(vec![1, 2]), vec![0; 6]);
        mesh.attributes = vec![
            Attribute { name: "x".into(), components: 1, ..numbers.clone() },
            Attribute { name: "a b\n".into(), ..numbers.clone() },
            Attribute { name: "a_b_".into(), ..numbers.clone() },
            Attribute { semantic: Semantic::Weights, ..numbers },
        ];
        mesh.part_names = vec![String::new(); 3];
        mesh.libraries = vec!["a.mtl".into()];
        let (header, source) = back(&mesh);
        for name in ["x_", "a_b__0", "a_b__1", "a_b__0_", "a_b__1_", "weights_0", "weights_1"] {
            assert!(header.contains(&format!("property uchar {name}\n")), "{name} {header}");
        }
        assert_eq!(source.mesh.attributes.len(), 7);
        assert_eq!(
            unwritten(&mesh),
            ["PLY has no place for names of parts (3)", "PLY has no place for material libraries (1)"]
        );
    }
}
