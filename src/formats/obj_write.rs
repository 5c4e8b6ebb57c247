//! Writes OBJ.

use std::io::{self, BufWriter, Write};

use crate::mesh::IndexedMesh;
use crate::mesh::attributes::{Attribute, Domain, NO_VALUE, Semantic};

use super::obj_parts::{SMOOTHING, STATEMENTS};
use super::write::{
    check, finite, fraction, in_line, is_picture, no_place, of_vertices, precision, write_number,
};
use super::{Format, Precision};

/// Writes an OBJ file, each coordinate as the shortest decimal that reads back exactly in the precision: 0.1 is
/// 0.1 in binary32, and 0.10000000149011612 in binary64.
///
/// It keeps texture coordinates and normals of corners, colours of vertices, as fractions behind the coordinates, parts by the statements
/// that their names are (`g` and the name where these are others), smoothing groups and libraries of materials;
/// [`unwritten`](super::unwritten) tells what it does not. Their decimals are those of the type that they are stored in.
///
/// # Errors
/// What `out` says; [`io::ErrorKind::InvalidInput`] where a coordinate is not finite in the wanted precision, or the attributes are
/// not those of the mesh.
pub fn write_obj(mesh: &IndexedMesh, precision: Precision, out: &mut impl Write) -> io::Result<()> {
    check(mesh)?;
    let kept = Kept::new(mesh);
    let mut out = BufWriter::new(out);
    for library in mesh.libraries.iter().filter(|library| !is_picture(library)) {
        writeln!(out, "mtllib {}", in_line(library))?;
    }
    for (v, &position) in mesh.positions.iter().enumerate() {
        out.write_all(b"v")?;
        for x in position {
            match precision {
                Precision::Float32 => finite(f64::from(x as f32), x)?,
                Precision::Float64 => finite(x, x)?,
            };
            out.write_all(b" ")?;
            write_number(&mut out, x, precision)?;
        }
        if let Some((colours, of)) = &kept.colours
            && of[v] != NO_VALUE
        {
            write_value(&mut out, colours, of[v] as usize)?;
        }
        out.write_all(b"\n")?;
    }
    for (list, keyword) in [(kept.uv, "vt"), (kept.normals, "vn")] {
        for value in 0..list.map_or(0, Attribute::count) {
            out.write_all(keyword.as_bytes())?;
            list.map_or(Ok(()), |list| write_value(&mut out, list, value))?;
            out.write_all(b"\n")?;
        }
    }
    let (mut part, mut statements, mut group) = (None, [const { String::new() }; 3], 0);
    for (t, &triangle) in mesh.triangles.iter().enumerate() {
        let number = |a: &Attribute| a.at(t, 0).map(|value| a.values.number(value) as usize);
        if let Some(parts) = kept.parts {
            let now = number(parts);
            if part.replace(now) != Some(now) {
                let wanted = now.map_or_else(Default::default, |part| statements_of(mesh, part));
                write_statements(&mut out, &mut statements, wanted)?;
            }
        }
        if let Some(groups) = kept.smoothing {
            let now = number(groups).unwrap_or(0);
            if std::mem::replace(&mut group, now) != now {
                writeln!(out, "s {now}")?;
            }
        }
        out.write_all(b"f")?;
        for (k, v) in triangle.into_iter().enumerate() {
            write!(out, " {}", u64::from(v) + 1)?;
            match [kept.uv, kept.normals].map(|list| list.and_then(|list| list.at(t, k))) {
                [None, None] => {}
                [Some(uv), None] => write!(out, "/{}", uv + 1)?,
                [None, Some(normal)] => write!(out, "//{}", normal + 1)?,
                [Some(uv), Some(normal)] => write!(out, "/{}/{}", uv + 1, normal + 1)?,
            }
        }
        out.write_all(b"\n")?;
    }
    out.flush()
}

/// Writes the numbers of a value, a blank before each.
fn write_value(out: &mut impl Write, attribute: &Attribute, value: usize) -> io::Result<()> {
    let first = value * attribute.components;
    (first..first + attribute.components).try_for_each(|at| {
        out.write_all(b" ")?;
        write_number(out, fraction(attribute, at), precision(attribute))
    })
}

/// The names of object, group and material that lead to a part.
fn statements_of(mesh: &IndexedMesh, part: usize) -> [String; 3] {
    let Some(name) = mesh.part_names.get(part) else {
        return [String::new(), format!("part {part}"), String::new()];
    };
    let mut names = [const { String::new() }; 3];
    for line in name.lines() {
        let statement = STATEMENTS
            .iter()
            .position(|keyword| line.strip_prefix(keyword).is_some_and(|name| name.starts_with(' ')));
        match statement {
            Some(row) => names[row] = line[STATEMENTS[row].len()..].trim().to_owned(),
            // Not as this format names parts.
            None => return [String::new(), in_line(name), String::new()],
        }
    }
    names
}

/// Writes what leads from some names to others.
fn write_statements(out: &mut impl Write, now: &mut [String; 3], wanted: [String; 3]) -> io::Result<()> {
    if now[0] != wanted[0] {
        // An object begins without a group.
        now[1].clear();
    }
    for ((keyword, now), wanted) in STATEMENTS.iter().zip(now).zip(wanted) {
        if *now != wanted {
            writeln!(out, "{}", format!("{keyword} {wanted}").trim_end())?;
            *now = wanted;
        }
    }
    Ok(())
}

/// What of a mesh has a place in the file.
struct Kept<'a> {
    uv: Option<&'a Attribute>,
    normals: Option<&'a Attribute>,
    /// And the value of each vertex.
    colours: Option<(&'a Attribute, Vec<u32>)>,
    parts: Option<&'a Attribute>,
    smoothing: Option<&'a Attribute>,
}

impl<'a> Kept<'a> {
    /// Of each semantic the first attribute that suits.
    fn new(mesh: &'a IndexedMesh) -> Self {
        let all = || mesh.attributes.iter();
        let at_corners = |semantic, components: &[usize]| {
            all().find(|a| {
                a.semantic == semantic && a.domain == Domain::Corner && components.contains(&a.components)
            })
        };
        let of_triangles = |semantic, name: &str| {
            all().find(|a| {
                (a.semantic, a.domain, a.components) == (semantic, Domain::Triangle, 1)
                    && (name.is_empty() || a.name == name && !a.values.stored().is_float())
            })
        };
        let colours = at_corners(Semantic::Color, &[3, 4]);
        Self {
            uv: at_corners(Semantic::TexCoord, &[2, 3]),
            normals: at_corners(Semantic::Normal, &[3]),
            colours: colours.and_then(|colours| Some((colours, of_vertices(colours, mesh)?))),
            parts: of_triangles(Semantic::Part, ""),
            smoothing: of_triangles(Semantic::Generic, SMOOTHING),
        }
    }
}

/// See [`unwritten`](super::unwritten).
pub(super) fn unwritten(mesh: &IndexedMesh) -> Vec<String> {
    let kept = Kept::new(mesh);
    let kept = [kept.uv, kept.normals, kept.colours.map(|colours| colours.0), kept.parts, kept.smoothing];
    let others =
        mesh.attributes.iter().filter(|a| !kept.iter().flatten().any(|kept| std::ptr::eq(*kept, *a)));
    let mut lost: Vec<String> = no_place(Format::Obj, others).into_iter().collect();
    let pictures = mesh.libraries.iter().filter(|library| is_picture(library)).count();
    if pictures > 0 {
        lost.push(format!("OBJ has no place for names of texture files ({pictures})"));
    }
    lost
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::read_bytes;
    use crate::mesh::attributes::Values;

    fn written(mesh: &IndexedMesh) -> String {
        let mut text = Vec::new();
        write_obj(mesh, Precision::Float64, &mut text).unwrap();
        String::from_utf8(text).unwrap()
    }

    /// All that the format has, as it is written.
    const TEXT: &str = "mtllib a b.mtl\nv 0 0 0 1 0.5 0\nv 1 0 0\nv 0 1 0 0.1 0.2 1e-5\nv 1 1 1 0 0 0\nvt 0.5 0.25\nvt NaN 1e-7\n\
        vt 0.3333333333333333 0\nvn 0 0 1\nvn 0.6 0 0.8\nf 1/1/1 2/2/2 3//2\ng left\nusemtl red\ns 3\nf 3 2 4//2\no b\nf 1/3 2/1 3/2\n\
        o\ns 0\nf 1 2 4\ng left\nf 4 2 1\n";

    #[test]
    fn what_is_read_is_written() {
        let source = read_bytes(TEXT.as_bytes(), None, "").unwrap();
        assert_eq!((source.dropped.len(), source.mesh.attributes.len()), (0, 5));
        assert_eq!(written(&source.mesh), TEXT);
        assert_eq!(unwritten(&source.mesh), [""; 0]);
    }

    #[test]
    fn parts_of_other_names() {
        let mut mesh = IndexedMesh::new(vec![[0.0; 3]; 3], vec![[0, 1, 2]; 3]);
        mesh.attributes.push(Attribute::parts(&[1, 0, 7]));
        mesh.part_names = vec!["wheel,\nsteel".to_owned(), "usemtl a\no b".to_owned()];
        let text = "v 0 0 0\nv 0 0 0\nv 0 0 0\no b\nusemtl a\nf 1 2 3\no\ng wheel, steel\nusemtl\nf 1 2 3\ng part 7\nf 1 2 3\n";
        assert_eq!(written(&mesh), text);
    }

    #[test]
    fn integers_that_stand_for_fractions() {
        let mut mesh = IndexedMesh::new(vec![[0.0; 3]; 3], vec![[0, 1, 2]]);
        let values = Values::U8(vec![255, 0, 51, 255, 0, 51]);
        let colours = Attribute::new(Semantic::Color, 3, values, vec![0, 1, NO_VALUE]);
        mesh.attributes.push(Attribute { normalised: true, ..colours });
        let text = "v 0 0 0 1 0 0.2\nv 0 0 0 1 0 0.2\nv 0 0 0\nf 1 2 3\n";
        assert_eq!(written(&mesh), text);
        mesh.attributes[0].values = Values::I16(vec![i16::MIN, i16::MAX, 0, 1, 1, 1]);
        mesh.attributes[0].semantic = Semantic::Normal;
        assert!(written(&mesh).contains("\nvn -1 1 0\n"), "{}", written(&mesh));
    }

    #[test]
    fn what_has_no_place() {
        let mut mesh = IndexedMesh::new(vec![[0.0; 3]; 3], vec![[0, 1, 2]; 2]);
        let uv = |corners: [u32; 3]| {
            let corners = [corners, [0, 1, 2]].concat();
            Attribute::new(Semantic::TexCoord, 2, Values::F32(vec![0.0, 0.0, 1.0, 0.0, 0.0, 2.0]), corners)
        };
        mesh.attributes = vec![
            uv([0, 1, 2]),
            Attribute { set: 1, ..uv([0, 1, 2]) },
            // One vertex has two colours.
            Attribute {
                semantic: Semantic::Color,
                components: 3,
                corners: vec![0, 1, 1, 0, 1, 0],
                ..uv([0; 3])
            },
            Attribute {
                semantic: Semantic::Normal,
                components: 3,
                domain: Domain::Triangle,
                corners: vec![0, 1],
                ..uv([0; 3])
            },
        ];
        mesh.libraries = vec!["a.PNG".to_owned(), "b.mtl".to_owned()];
        let told = [
            "OBJ has no place for uv1, color, normal of triangles",
            "OBJ has no place for names of texture files (1)",
        ];
        assert_eq!(unwritten(&mesh), told);
        assert!(written(&mesh).starts_with("mtllib b.mtl\nv 0 0 0\n"));
    }
}
