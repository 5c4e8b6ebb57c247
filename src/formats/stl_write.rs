//! Writes STL.

use std::io::{self, BufWriter, Write};

use byteorder::{ByteOrder, LittleEndian, WriteBytesExt};

use crate::mesh::IndexedMesh;
use crate::mesh::attributes::{Attribute, Domain, Semantic, Stored, Values};

use super::Format;
use super::stl_colours::{self, ATTRIBUTE};
use super::write::{check, finite, fraction, no_place, unit_normal};

/// Writes a binary STL file: three corners a triangle, as binary32, to the nearest. Vertices that triangles share are
/// repeated, those of no triangle are left out. Normals follow from the corners (0 where they are in one line).
/// Colours of triangles are kept in five bits a component, in the way of VisCAM; [`unwritten`](super::unwritten) tells what is not.
///
/// # Errors
/// What `out` says; [`io::ErrorKind::InvalidInput`] where a coordinate is not finite in binary32, there are more
/// than 2^32 - 1 triangles, or the attributes are not those of the mesh.
pub fn write_stl(mesh: &IndexedMesh, out: &mut impl Write) -> io::Result<()> {
    check(mesh)?;
    let mut out = BufWriter::new(out);
    let triangles = u32::try_from(mesh.triangles.len()).map_err(|_| {
        io::Error::new(io::ErrorKind::InvalidInput, "an STL file has at most 2^32 - 1 triangles")
    })?;
    // Not `solid`, by which some readers know a text file.
    out.write_all(&[b' '; 80])?;
    out.write_u32::<LittleEndian>(triangles)?;
    let words = words(mesh);
    for (t, triangle) in mesh.triangles.iter().enumerate() {
        let mut facet = [0; 50];
        let corners = triangle.map(|v| mesh.positions[v as usize]);
        if let Some(words) = &words {
            LittleEndian::write_u16(&mut facet[48..], word(words, t));
        }
        let (normal, numbers) = facet.split_at_mut(12);
        for (bytes, &x) in numbers[..36].chunks_exact_mut(4).zip(corners.as_flattened()) {
            finite(f64::from(x as f32), x)?;
            LittleEndian::write_f32(bytes, x as f32);
        }
        for (bytes, x) in normal.chunks_exact_mut(4).zip(unit_normal(corners)) {
            LittleEndian::write_f32(bytes, x as f32);
        }
        out.write_all(&facet)?;
    }
    out.flush()
}

/// What the two bytes of a facet hold.
enum Words<'a> {
    Colours(&'a Attribute),
    Numbers(&'a Attribute, &'a [u16]),
}

fn words(mesh: &IndexedMesh) -> Option<Words<'_>> {
    mesh.attributes.iter().filter(|a| a.domain == Domain::Triangle).find_map(|a| {
        match (&a.values, a.semantic) {
            (_, Semantic::Color) if a.components >= 3 => Some(Words::Colours(a)),
            (Values::U16(list), Semantic::Generic) if a.components == 1 && a.name == ATTRIBUTE => {
                Some(Words::Numbers(a, list))
            }
            _ => None,
        }
    })
}

/// The word of a triangle; 0 where it has none.
fn word(words: &Words, triangle: usize) -> u16 {
    let word = match words {
        Words::Colours(a) => a.at(triangle, 0).map(|value| stl_colours::word(rgb(a, value))),
        Words::Numbers(a, list) => a.at(triangle, 0).map(|value| list[value]),
    };
    word.unwrap_or(0)
}

fn rgb(attribute: &Attribute, value: usize) -> [f64; 3] {
    [0, 1, 2].map(|k| fraction(attribute, value * attribute.components + k))
}

/// See [`unwritten`](super::unwritten).
pub(super) fn unwritten(mesh: &IndexedMesh) -> Vec<String> {
    let kept = words(mesh).map(|words| match words {
        Words::Colours(a) | Words::Numbers(a, _) => a,
    });
    let others = mesh.attributes.iter().filter(|a| kept.is_none_or(|kept| !std::ptr::eq(kept, *a)));
    let mut lost: Vec<String> = no_place(Format::Stl, others).into_iter().collect();
    if let Some(colours) = kept.filter(|a| a.semantic == Semantic::Color) {
        let exact = |value: usize| {
            let back = stl_colours::rgb(stl_colours::word(rgb(colours, value)));
            (0..3).all(|k| colours.values.number(value * colours.components + k) == f64::from(back[k]))
        };
        if colours.components > 3 || colours.values.stored() != Stored::U8 || !(0..colours.count()).all(exact)
        {
            lost.push(
                "STL has colours of five bits a component and no alpha: colours are rounded".to_owned(),
            );
        }
    }
    lost
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::read_bytes;

    fn two() -> IndexedMesh {
        IndexedMesh::new(vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], vec![[0, 1, 2], [2, 1, 0]])
    }

    fn of_triangles(semantic: Semantic, components: usize, values: Values, corners: Vec<u32>) -> Attribute {
        let attribute = Attribute::new(semantic, components, values, corners);
        Attribute { domain: Domain::Triangle, normalised: semantic == Semantic::Color, ..attribute }
    }

    #[test]
    fn words_of_facets_come_back() {
        let none = crate::mesh::attributes::NO_VALUE;
        let colours = of_triangles(Semantic::Color, 3, Values::U8(vec![255, 0, 8]), vec![none, 0]);
        let numbers = of_triangles(Semantic::Generic, 1, Values::U16(vec![7, 500]), vec![0, 1]);
        for attribute in [colours, Attribute { name: ATTRIBUTE.to_owned(), ..numbers }] {
            let mut mesh = two();
            mesh.attributes.push(attribute);
            assert_eq!(unwritten(&mesh), [""; 0]);
            let mut bytes = Vec::new();
            write_stl(&mesh, &mut bytes).unwrap();
            let back = read_bytes(&bytes, None, "").unwrap();
            assert_eq!((back.mesh.attributes, back.dropped.len()), (mesh.attributes, 0));
        }
    }

    #[test]
    fn what_has_no_place() {
        let mut mesh = two();
        mesh.attributes.push(Attribute::new(Semantic::TexCoord, 2, Values::F32(vec![0.0; 2]), vec![0; 6]));
        mesh.attributes.push(of_triangles(Semantic::Color, 3, Values::U8(vec![255, 0, 9]), vec![0, 0]));
        mesh.attributes.push(Attribute::parts(&[1, 2]));
        let rounded = "STL has colours of five bits a component and no alpha: colours are rounded";
        assert_eq!(unwritten(&mesh), ["STL has no place for uv, part", rounded]);
        mesh.attributes.pop().unwrap().corners.pop();
        mesh.attributes[0].corners.pop();
        let kind = write_stl(&mesh, &mut io::sink()).unwrap_err().kind();
        assert_eq!(kind, io::ErrorKind::InvalidInput);
    }
}
