//! Columns of a PLY element that are attributes.
//!
//! By their names: `nx ny nz` are normals, `tx ty tz tw` tangents, `s t`, `u v`, `texture_u texture_v` and `texture_s texture_t` texture
//! coordinates, `red green blue`, perhaps `alpha`, and `diffuse_red` and so on and `r g b` colours; with a digit behind each name they are
//! further sets. Integers of colours stand for fractions. Of a face `texnumber` or `material_index` is its part; a negative one is
//! none. Any other number is an attribute of its own, by its name.

use crate::mesh::attributes::{Attribute, Domain, NO_VALUE, Semantic, Stored, Values};

use super::gather::{self, Gathered};
use super::ply_header::{Element, Kind, Property, Scalar};

/// The attributes of an element, row by row.
pub(super) struct Columns {
    groups: Vec<Group>,
    /// Whether each column is one of an attribute.
    pub kept: Vec<bool>,
}

/// Columns that are an attribute together.
struct Group {
    semantic: Semantic,
    columns: Vec<usize>,
    normalised: bool,
    name: String,
    /// In words, a plural.
    what: String,
    values: Values,
}

impl Columns {
    /// The columns of an element that are attributes; those that are `read` already are none. The others are named in `dropped`.
    pub(super) fn new(element: &Element, read: &[usize], dropped: &mut Vec<String>) -> Self {
        let properties = &element.properties;
        let mut columns = Self { groups: Vec::new(), kept: vec![false; properties.len()] };
        let mut taken = vec![false; properties.len()];
        read.iter().for_each(|&column| taken[column] = true);
        for column in 0..properties.len() {
            if taken[column] {
                continue;
            }
            match properties[column].kind {
                Kind::Scalar(scalar) if columns.groups.len() < gather::MOST => {
                    let group = columns.group(element, column, scalar, &taken);
                    group.columns.iter().for_each(|&column| {
                        taken[column] = true;
                        columns.kept[column] = true;
                    });
                    columns.groups.push(group);
                }
                _ => {
                    let note =
                        format!("{} property {}", element.name, properties[column].name.escape_debug());
                    if !dropped.contains(&note) {
                        dropped.push(note);
                    }
                }
            }
        }
        columns
    }

    /// The attribute that a column belongs to.
    fn group(&self, element: &Element, column: usize, scalar: Scalar, taken: &[bool]) -> Group {
        let free = |name: &str| {
            let same = |(column, p): (usize, &Property)| {
                !taken[column] && p.kind == Kind::Scalar(scalar) && p.name == name
            };
            element.properties.iter().enumerate().position(same)
        };
        let (owner, name) = (&element.name, &element.properties[column].name);
        let group = |semantic, columns, what: &str| Group {
            semantic,
            columns,
            normalised: semantic == Semantic::Color && scalar.integers().is_some(),
            name: String::new(),
            what: format!("{owner} {what}"),
            values: Values::new(stored(scalar)),
        };
        let digit = if name.ends_with(|c: char| c.is_ascii_digit()) { &name[name.len() - 1..] } else { "" };
        let base = &name[..name.len() - digit.len()];
        for (semantic, names, optional, what) in KNOWN {
            // Directions and texture coordinates are not integers.
            let suits = *semantic == Semantic::Color || scalar.integers().is_none();
            if !suits || !names.contains(&base) {
                continue;
            }
            let found: Option<Vec<usize>> =
                names.iter().map(|name| free(&format!("{name}{digit}"))).collect();
            if let Some(mut columns) = found {
                columns.extend(optional.and_then(|name| free(&format!("{name}{digit}"))));
                return group(*semantic, columns, what);
            }
        }
        if element.name == "face" && PARTS.contains(&name.as_str()) && scalar.integers().is_some() {
            return Group {
                values: Values::new(Stored::I32),
                ..group(Semantic::Part, vec![column], "parts")
            };
        }
        let what = format!("property {}", name.escape_debug());
        Group { name: name.clone(), ..group(Semantic::Generic, vec![column], &what) }
    }

    /// Takes a row, of which the kept columns are the numbers' bits.
    #[inline]
    pub(super) fn row(&mut self, bits: &[u64]) {
        for group in &mut self.groups {
            for &column in &group.columns {
                group.values.push_bits(bits[column]);
            }
        }
    }

    /// The attributes, if row v is that of vertex v.
    pub(super) fn of_vertices(self, triangles: &[[u32; 3]], gathered: &mut Gathered) {
        for group in self.groups {
            let (semantic, components) = (group.semantic, group.columns.len());
            let attribute = gather::of_vertices(semantic, components, group.values, None, triangles);
            let attribute = Attribute { name: group.name, normalised: group.normalised, ..attribute };
            gathered.take(attribute, &group.what);
        }
    }

    /// The attributes of triangles; `rows` tells the row of each.
    pub(super) fn of_triangles(self, rows: &[u32], gathered: &mut Gathered) {
        for group in self.groups {
            let (semantic, components) = (group.semantic, group.columns.len());
            let attribute = match &group.values {
                Values::I32(parts) if semantic == Semantic::Part => {
                    let number =
                        |&row: &u32| parts.get(row as usize).map_or(NO_VALUE, |&part| part.max(-1) as u32);
                    gather::numbers(semantic, rows.iter().map(number).collect())
                }
                _ => Attribute {
                    domain: Domain::Triangle,
                    ..Attribute::new(semantic, components, group.values, rows.to_vec())
                },
            };
            let attribute = Attribute { name: group.name, normalised: group.normalised, ..attribute };
            gathered.take(attribute, &group.what);
        }
    }
}

fn stored(scalar: Scalar) -> Stored {
    match scalar {
        Scalar::I8 => Stored::I8,
        Scalar::U8 => Stored::U8,
        Scalar::I16 => Stored::I16,
        Scalar::U16 => Stored::U16,
        Scalar::I32 => Stored::I32,
        Scalar::U32 => Stored::U32,
        Scalar::F32 => Stored::F32,
        Scalar::F64 => Stored::F64,
    }
}

/// What columns of some names are together: those that must be there, and one that may.
type Known = (Semantic, &'static [&'static str], Option<&'static str>, &'static str);
pub(super) const KNOWN: &[Known] = &[
    (Semantic::Normal, &["nx", "ny", "nz"], None, "normals"),
    (Semantic::Tangent, &["tx", "ty", "tz", "tw"], None, "tangents"),
    (Semantic::TexCoord, &["s", "t"], None, UV),
    (Semantic::TexCoord, &["u", "v"], None, UV),
    (Semantic::TexCoord, &["texture_u", "texture_v"], None, UV),
    (Semantic::TexCoord, &["texture_s", "texture_t"], None, UV),
    (Semantic::Color, &["red", "green", "blue"], Some("alpha"), "colours"),
    (Semantic::Color, &["diffuse_red", "diffuse_green", "diffuse_blue"], Some("diffuse_alpha"), "colours"),
    (Semantic::Color, &["r", "g", "b"], Some("a"), "colours"),
];
const UV: &str = "texture coordinates";

/// Columns of faces that number their textures or materials.
const PARTS: [&str; 2] = ["texnumber", "material_index"];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::{Format, Source, read_bytes};

    /// A file of one triangle, whose vertices have further columns.
    fn source(columns: &[&str], rows: [&str; 3]) -> Source {
        let columns: String = columns.iter().map(|column| format!("property {column}\n")).collect();
        let text = format!(
            "ply\nformat ascii 1.0\ncomment TextureFile a b.png\nelement vertex 3\nproperty int x\n{columns}property int y\n\
             property int z\nelement face 1\nproperty list uchar int vertex_index\nend_header\n\
             0 {} 0 0\n1 {} 0 0\n0 {} 1 0\n3 2 0 1\n",
            rows[0], rows[1], rows[2]
        );
        read_bytes(text.as_bytes(), Some(Format::Ply), "").unwrap()
    }

    #[test]
    fn columns_that_belong_together() {
        let columns = [
            "float nz",
            "float nx",
            "float ny",
            "uchar blue",
            "uchar green",
            "uchar red",
            "uchar alpha",
            "double s",
            "double t",
        ];
        let s =
            source(&columns, ["3 1 2 30 20 10 40 .1 .2", "6 4 5 60 50 0 70 nan inf", "9 7 8 1 1 1 1 .5 .6"]);
        let [normal, color, uv] = &s.mesh.attributes[..] else { panic!("{s:?}") };
        let values = (1..10u8).map(f32::from).collect();
        assert_eq!(
            (normal.semantic, normal.components, &normal.values),
            (Semantic::Normal, 3, &Values::F32(values))
        );
        let values = Values::U8(vec![10, 20, 30, 40, 0, 50, 60, 70, 1, 1, 1, 1]);
        assert_eq!((color.semantic, color.components, &color.values), (Semantic::Color, 4, &values));
        assert_eq!([normal.normalised, color.normalised, uv.normalised], [false, true, false]);
        assert_eq!((uv.semantic, uv.components, &uv.name[..]), (Semantic::TexCoord, 2, ""));
        let Values::F64(list) = &uv.values else { panic!() };
        assert_eq!(([list[0], list[1], list[3]], list[2].is_nan()), ([0.1, 0.2, f64::INFINITY], true));
        assert!([normal, color, uv].iter().all(|a| a.domain == Domain::Corner && a.corners == [2, 0, 1]));
        assert_eq!((&s.dropped[..], &s.mesh.libraries[..]), (&[][..], &["a b.png".to_owned()][..]));
    }

    #[test]
    fn columns_of_other_names_and_types_are_attributes_of_their_own() {
        let columns = [
            "float u",
            "float v",
            "float u1",
            "float v1",
            "int nx",
            "int ny",
            "int nz",
            "float red",
            "uchar green",
            "float s",
            "list uchar int l",
        ];
        let s =
            source(&columns, ["1 2 3 4 5 6 7 8 9 10 0", "0 0 0 0 0 0 0 0 0 0 1 7", "0 0 0 0 0 0 0 0 0 0 0"]);
        let told = |a: &Attribute| format!("{}/{}", a.title(), a.components);
        let titles: Vec<String> = s.mesh.attributes.iter().map(told).collect();
        assert_eq!(titles, ["uv/2", "uv1/2", "nx/1", "ny/1", "nz/1", "red/1", "green/1", "s/1"]);
        assert_eq!(s.mesh.attributes[2].values, Values::I32(vec![5, 0, 0]));
        assert_eq!(s.dropped, ["vertex property l"]);
    }

    #[test]
    fn no_more_than_a_file_holds() {
        let names: Vec<String> = (0..70).map(|k| format!("uchar p{k}")).collect();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let row = "1 ".repeat(70);
        let s = source(&names, [&row; 3]);
        assert_eq!(
            (s.mesh.attributes.len(), s.dropped.len(), &s.dropped[0][..]),
            (64, 6, "vertex property p64")
        );
    }
}
