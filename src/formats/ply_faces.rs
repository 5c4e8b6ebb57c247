//! Faces and strips of a PLY file.

use crate::error::Result;
use crate::mesh::attributes::{Attribute, NO_VALUE, Semantic, Stored, Values as Numbers};

use super::fan::Fans;
use super::gather::Gathered;
use super::origins::Origins;
use super::ply_columns::Columns;
use super::ply_header::{Element, Kind, Scalar};
use super::ply_values::Values;

/// The attributes of the faces of an element.
pub(super) struct FaceAttributes {
    /// The first of them among all faces.
    first: u32,
    rows: u32,
    columns: Columns,
    wedges: Option<Wedges>,
}

/// Texture coordinates of corners: of each face a list, of two numbers a corner or of none.
struct Wedges {
    column: usize,
    values: Numbers,
    by_corner: Vec<u32>,
}

/// Reads an element of faces, whose vertices are the list of column `indices`.
pub(super) fn read_faces(
    values: &mut impl Values,
    element: &Element,
    indices: usize,
    vertices: u64,
    fans: &mut Fans,
    dropped: &mut Vec<String>,
) -> Result<FaceAttributes> {
    if let Kind::List(_, item) = element.properties[indices].kind {
        let room = values.at_most(item) / 3;
        fans.triangles.reserve(usize::try_from(element.count).map_or(room, |n| n.min(room)));
    }
    let texcoord = element.properties.iter().enumerate().find_map(|(column, property)| match property.kind {
        Kind::List(_, Scalar::F32) if property.name == "texcoord" => Some((column, Stored::F32)),
        Kind::List(_, Scalar::F64) if property.name == "texcoord" => Some((column, Stored::F64)),
        _ => None,
    });
    let read: Vec<usize> =
        [Some(indices), texcoord.map(|(column, _)| column)].into_iter().flatten().collect();
    let wedges = texcoord.map(|(column, stored)| Wedges {
        column,
        values: Numbers::new(stored),
        by_corner: Vec::new(),
    });
    let columns = Columns::new(element, &read, dropped);
    let mut attributes = FaceAttributes { first: fans.faces(), rows: 0, columns, wedges };
    let mut row = vec![0; element.properties.len()];
    let mut list = Vec::new();
    let any = attributes.columns.kept.iter().any(|&kept| kept);
    for face in 0..element.count {
        let first = fans.corners();
        list.clear();
        for (k, property) in element.properties.iter().enumerate() {
            match property.kind {
                Kind::List(length, item) if k == indices => {
                    for _ in 0..list_length(values, length)? {
                        let index = values.integer(item)?;
                        fans.corner(vertex(values, index, vertices)?);
                    }
                }
                Kind::List(length, item) if attributes.wedges.as_ref().is_some_and(|w| w.column == k) => {
                    for _ in 0..list_length(values, length)? {
                        list.push(values.bits(item)?);
                    }
                }
                Kind::Scalar(scalar) if attributes.columns.kept[k] => row[k] = values.bits(scalar)?,
                kind => skip(values, kind)?,
            }
        }
        let corners = fans.corners() - first;
        fans.end();
        if any {
            attributes.columns.row(&row);
        }
        if let Some(wedges) = &mut attributes.wedges
            && !list.is_empty()
        {
            if list.len() != 2 * corners {
                let (numbers, needed) = (list.len(), 2 * corners);
                let what =
                    format!("face {face} has {numbers} texture coordinates, and its corners need {needed}");
                return Err(values.fault(what));
            }
            wedges.by_corner.resize(first, NO_VALUE);
            let value = (wedges.values.len() / 2) as u32;
            wedges.by_corner.extend((0..corners as u32).map(|corner| value + corner));
            list.iter().for_each(|&bits| wedges.values.push_bits(bits));
        }
    }
    attributes.rows = fans.faces() - attributes.first;
    Ok(attributes)
}

impl FaceAttributes {
    /// Whether there are none.
    pub(super) fn is_empty(&self) -> bool {
        self.wedges.is_none() && !self.columns.kept.contains(&true)
    }

    /// The attributes, once it is known what became of the faces.
    pub(super) fn take(self, origins: &Origins, gathered: &mut Gathered) {
        let rows: Vec<u32> = (0..self.first).map(|_| NO_VALUE).chain(0..self.rows).collect();
        if let Some(wedges) = self.wedges {
            let corners = origins.of_corners(&wedges.by_corner);
            let uv = Attribute::new(Semantic::TexCoord, 2, wedges.values, corners);
            gathered.take(uv, "face texture coordinates");
        }
        if self.columns.kept.contains(&true) {
            self.columns.of_triangles(&origins.of_faces(&rows), gathered);
        }
    }
}

/// Reads an element of strips. A triangle of one counts as a face.
pub(super) fn read_strips(
    values: &mut impl Values,
    element: &Element,
    column: usize,
    vertices: u64,
    fans: &mut Fans,
) -> Result<()> {
    for _ in 0..element.count {
        for (k, property) in element.properties.iter().enumerate() {
            match property.kind {
                Kind::List(length, item) if k == column => {
                    let mut before = [0; 2];
                    let mut corners = 0u64;
                    for _ in 0..list_length(values, length)? {
                        let index = values.integer(item)?;
                        if index == -1 {
                            corners = 0;
                            continue;
                        }
                        let ([a, b], c) = (before, vertex(values, index, vertices)?);
                        if corners >= 2 && a != b && b != c && c != a {
                            let triangle = if corners.is_multiple_of(2) { [a, b, c] } else { [b, a, c] };
                            triangle.into_iter().for_each(|v| fans.corner(v));
                            fans.end();
                        }
                        before = [b, c];
                        corners += 1;
                    }
                }
                kind => skip(values, kind)?,
            }
        }
    }
    Ok(())
}

#[inline]
pub(super) fn skip(values: &mut impl Values, kind: Kind) -> Result<()> {
    match kind {
        Kind::Scalar(scalar) => values.skip(scalar, 1),
        Kind::List(length, item) => {
            let length = list_length(values, length)?;
            values.skip(item, length)
        }
    }
}

#[inline]
fn list_length(values: &mut impl Values, scalar: Scalar) -> Result<u64> {
    let length = values.integer(scalar)?;
    u64::try_from(length).map_err(|_| values.fault(format!("a list of length {length}")))
}

/// The index read last, checked.
#[inline]
fn vertex(values: &impl Values, index: i64, vertices: u64) -> Result<u32> {
    match u32::try_from(index) {
        Ok(v) if u64::from(v) < vertices => Ok(v),
        _ => {
            Err(values
                .fault(format!("vertex index {index} is out of range: the file has {vertices} vertices")))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::{Format, Source, read_bytes};

    fn read(face: &str, data: &str) -> Result<Source> {
        let header =
            "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n";
        let positions = "0 0 0\n1 1 0\n4 0 0\n1 3 0\n";
        let text = format!("{header}{face}end_header\n{positions}{data}");
        read_bytes(text.as_bytes(), Some(Format::Ply), "a.ply")
    }

    const FACE: &str = "element face 4\nproperty list uchar double texcoord\nproperty list uchar int vertex_indices\n\
        property int texnumber\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nproperty short n\n";

    #[test]
    fn faces_have_texture_coordinates_parts_and_colours() {
        // An arrow head that no fan from its first corner covers, of which corner k has texture coordinates k and k / 10; an edge; a
        // triangle without texture coordinates, and one.
        let head = "8 0 0 1 .1 2 .2 3 .3  4 0 1 2 3  5 255 0 1 -7\n";
        let rest =
            "4 9 9 8 8 2 0 1 4 0 0 0 0\n0 3 1 2 3 -1 7 8 9 300\n6 4 .4 5 .5 6 .6 3 3 2 1 5 255 0 1 0\n";
        let s = read(FACE, &format!("{head}{rest}")).unwrap();
        let corners = s.mesh.triangles[..2].as_flattened();
        assert!(s.mesh.triangles[..2].iter().all(|t| t.contains(&1) && t.contains(&3)), "{corners:?}");
        let [uv, part, color, n] = &s.mesh.attributes[..] else { panic!("{s:?}") };
        let expected = vec![0.0, 0.0, 1.0, 0.1, 2.0, 0.2, 3.0, 0.3, 4.0, 0.4, 5.0, 0.5, 6.0, 0.6];
        assert_eq!((uv.semantic, &uv.values), (Semantic::TexCoord, &Numbers::F64(expected)));
        assert_eq!(&uv.corners[..6], corners);
        assert_eq!(uv.corners[6..], [NO_VALUE, NO_VALUE, NO_VALUE, 4, 5, 6]);
        assert_eq!((part.semantic, &part.values), (Semantic::Part, &Numbers::U32(vec![5])));
        assert_eq!(part.corners, [0, 0, NO_VALUE, 0]);
        let colours = Numbers::U8(vec![255, 0, 1, 7, 8, 9, 255, 0, 1]);
        assert_eq!((color.semantic, &color.values, color.normalised), (Semantic::Color, &colours, true));
        assert_eq!((&color.corners[..], &n.values), (&[0, 0, 1, 2][..], &Numbers::I16(vec![-7, 300, 0])));
        let told = [
            "face texture coordinates of no triangle (2)",
            "face colours of no triangle (1)",
            "face property n of no triangle (1)",
            "faces with fewer than 3 corners (1)",
            "polygons (1, cut into triangles)",
        ];
        assert_eq!(s.dropped, told);
    }

    #[test]
    fn a_list_of_another_length_is_a_fault() {
        let face = FACE.replace("face 4", "face 1");
        let error = read(&face, "5 0 0 1 1 2 3 0 1 2 0 0 0 0 0\n").unwrap_err();
        let what = "face 0 has 5 texture coordinates, and its corners need 6";
        assert_eq!(error.to_string(), format!("a.ply: line 20: {what} (element face)"));
    }

    #[test]
    fn strips_and_further_faces_have_no_attributes_of_faces() {
        let strips = "element tristrips 1\nproperty list int int vertex_index\nproperty float w\n";
        let faces = "element face 1\nproperty list uchar int vertex_indices\nproperty float q\n";
        let s = read(&format!("{strips}{faces}{faces}"), "4 0 1 2 3 .5\n3 1 2 3 .25\n3 3 2 1 .75").unwrap();
        assert_eq!(s.mesh.triangles.len(), 4);
        let [q] = &s.mesh.attributes[..] else { panic!("{s:?}") };
        assert_eq!(
            (&q.values, &q.corners[..]),
            (&Numbers::F32(vec![0.25]), &[NO_VALUE, NO_VALUE, 0, NO_VALUE][..])
        );
        assert_eq!(s.dropped, ["tristrips property w", "attributes of a further element face"]);
    }
}
