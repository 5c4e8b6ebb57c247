//! What the command line says of attributes: which to leave out, and how exact the others are, from which level on, and at what price.

use unweld::encoder::AttributeBirth;
use unweld::mesh::IndexedMesh;
use unweld::mesh::attributes::{Attribute, Semantic};

/// Which attributes a file keeps, and how.
#[derive(clap::Args)]
pub struct Attributes {
    /// Bits of the numbers of attributes, 1 to 24, by their names or by normal, tangent, uv, color, weights, generic; where not given, 12 for uv
    /// and weights, 10 for normals and tangents, and integers are kept as they are
    #[arg(long, value_name = "NAME=N,...", value_delimiter = ',', value_parser = bits)]
    bits: Vec<(String, u32)>,
    /// Attributes to leave out, by their names or by normal, tangent, uv, color, joints, weights, part, generic; all for all
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    drop: Vec<String>,
    /// Where attributes are born, by names as in --bits: base, 0 (the finest level), or auto, for uv and part the coarsest level whose
    /// vertices are not mostly locked by their charts, as in uv=base
    #[arg(long, value_name = "NAME=base|0|auto,...", value_delimiter = ',', value_parser = birth)]
    attribute_birth: Vec<(String, AttributeBirth)>,
    /// What attributes weigh in the choice of what coarse levels lack, 0 or more, by names as in --bits; 1 where not given, as in normal=2; where there are no normals, uv weigh three eighths of it
    #[arg(long, value_name = "NAME=W,...", value_delimiter = ',', value_parser = weight)]
    weight: Vec<(String, f64)>,
}

impl Attributes {
    /// Bits as the library wants them, of those attributes that a mesh has: one command serves many meshes.
    pub fn bits(&self, mesh: &IndexedMesh) -> Vec<(String, u32)> {
        there(mesh, &self.bits)
    }

    /// So where they are born.
    pub fn births(&self, mesh: &IndexedMesh) -> Vec<(String, AttributeBirth)> {
        there(mesh, &self.attribute_birth)
    }

    /// So what they weigh.
    pub fn weights(&self, mesh: &IndexedMesh) -> Vec<(String, f64)> {
        there(mesh, &self.weight)
    }

    /// Takes out what is to be left out. Returns what went, in words for the user.
    pub fn drop_from(&self, mesh: &mut IndexedMesh) -> Vec<String> {
        let goes = |attribute: &Attribute| self.drop.iter().any(|name| name == "all" || is(attribute, name));
        let (gone, kept) = std::mem::take(&mut mesh.attributes).into_iter().partition(goes);
        mesh.attributes = kept;
        let gone: Vec<Attribute> = gone;
        if gone.iter().any(|attribute| attribute.semantic == Semantic::Part) {
            mesh.part_names.clear();
            mesh.libraries.clear();
        }
        gone.iter().map(|attribute| format!("{} (as asked for)", attribute.title())).collect()
    }

    /// Names and values as they are given.
    pub fn settings(&self) -> Vec<(String, String)> {
        let lists = [
            ("bits", list(&self.bits, u32::to_string)),
            ("drop", self.drop.join(",")),
            ("attribute-birth", list(&self.attribute_birth, |birth| birth_name(*birth).to_owned())),
            ("weight", list(&self.weight, f64::to_string)),
        ];
        lists
            .into_iter()
            .filter(|(_, list)| !list.is_empty())
            .map(|(name, list)| (name.to_owned(), list))
            .collect()
    }
}

/// What is said of attributes that a mesh has.
fn there<T: Clone>(mesh: &IndexedMesh, said: &[(String, T)]) -> Vec<(String, T)> {
    let is_there = |(name, _): &&(String, T)| mesh.attributes.iter().any(|attribute| is(attribute, name));
    said.iter().filter(is_there).cloned().collect()
}

fn is(attribute: &Attribute, name: &str) -> bool {
    attribute.title() == name || attribute.semantic.name() == name
}

fn list<T>(said: &[(String, T)], text: impl Fn(&T) -> String) -> String {
    said.iter().map(|(name, value)| format!("{name}={}", text(value))).collect::<Vec<_>>().join(",")
}

fn bits(text: &str) -> Result<(String, u32), String> {
    let (name, bits) = text.rsplit_once('=').ok_or("NAME=N is wanted, as in uv=12")?;
    let bits = bits.parse().ok().filter(|bits| (1..=24).contains(bits)).ok_or("allowed are 1 to 24 bits")?;
    Ok((name.to_owned(), bits))
}

fn birth(text: &str) -> Result<(String, AttributeBirth), String> {
    let (name, word) = text.rsplit_once('=').ok_or("NAME=LEVEL is wanted, as in uv=base")?;
    let all = [AttributeBirth::Auto, AttributeBirth::Base, AttributeBirth::Finest];
    let birth = all.into_iter().find(|&birth| birth_name(birth) == word);
    Ok((name.to_owned(), birth.ok_or("allowed are base, 0 and auto")?))
}

fn birth_name(birth: AttributeBirth) -> &'static str {
    match birth {
        AttributeBirth::Base => "base",
        AttributeBirth::Finest => "0",
        _ => "auto",
    }
}

fn weight(text: &str) -> Result<(String, f64), String> {
    let (name, weight) = text.rsplit_once('=').ok_or("NAME=W is wanted, as in normal=2")?;
    let weight = weight.parse().ok().filter(|weight: &f64| weight.is_finite() && *weight >= 0.0);
    Ok((name.to_owned(), weight.ok_or("allowed is a number of 0 or more")?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_said_comes_back() {
        for (text, said) in [
            ("uv=base", AttributeBirth::Base),
            ("uv=0", AttributeBirth::Finest),
            ("uv=auto", AttributeBirth::Auto),
        ] {
            assert_eq!(birth(text), Ok(("uv".to_owned(), said)));
            assert_eq!(list(&[birth(text).unwrap()], |birth| birth_name(*birth).to_owned()), text);
        }
        assert_eq!(weight("a=b=2.5"), Ok(("a=b".to_owned(), 2.5)));
        for bad in ["normal", "normal=-1", "normal=inf", "normal=nan", "normal=much"] {
            assert!(weight(bad).is_err(), "{bad}");
        }
        assert!(birth("uv=1").is_err() && birth("uv").is_err());
    }
}
