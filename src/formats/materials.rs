//! Materials of Wavefront's MTL: base colours, and the pictures that lie on them.

use crate::mesh::paint::{Material, TURNED, srgb_to_linear};

use super::text::quoted;

/// A material of a library.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Named {
    pub name: String,
    /// Without its picture.
    pub material: Material,
    /// What its picture is called.
    pub picture: Option<String>,
}

/// The materials of a library; of what it says the colour (`Kd`, in sRGB) and its picture (`map_Kd`, with `-o` and `-s`).
///
/// # Errors
/// The line at fault, in words.
pub(super) fn read(bytes: &[u8]) -> Result<Vec<Named>, String> {
    let text = String::from_utf8_lossy(bytes);
    let mut materials: Vec<Named> = Vec::new();
    for (k, line) in text.lines().enumerate() {
        let line = line.split('#').next().unwrap_or_default().trim();
        let (keyword, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        let rest = rest.trim();
        let fault = |what: &str| format!("line {}: {what} {}", k + 1, quoted(rest.as_bytes()));
        if keyword == "newmtl" {
            let material = Material { transform: TURNED, ..Material::default() };
            materials.push(Named { name: rest.to_owned(), material, picture: None });
            continue;
        }
        let Some(Named { material, picture, .. }) = materials.last_mut() else { continue };
        match keyword {
            // By a spectrum or in other coordinates, which nobody writes.
            "Kd" if rest.starts_with(char::is_alphabetic) => {}
            "Kd" => {
                let numbers: Option<Vec<f32>> =
                    rest.split_whitespace().map(|word| word.parse().ok()).collect();
                let colour = match numbers.as_deref() {
                    Some([grey]) => [*grey; 3],
                    Some([r, g, b]) => [*r, *g, *b],
                    _ => return Err(fault("no colour:")),
                };
                let [r, g, b] = colour.map(|x| srgb_to_linear(x.clamp(0.0, 1.0)));
                material.colour = [r, g, b, 1.0];
            }
            "map_Kd" => {
                let (transform, name) = map(rest).ok_or_else(|| fault("no picture:"))?;
                (material.transform, *picture) = (transform, Some(name.to_owned()));
            }
            _ => {}
        }
    }
    for Named { material, .. } in materials.iter_mut().filter(|named| named.picture.is_some()) {
        // So some programs write what has a picture; a black picture is meant by nobody.
        if material.colour[..3] == [0.0; 3] {
            material.colour = [1.0; 4];
        }
    }
    Ok(materials)
}

/// A library of one material, white but for its picture.
pub fn material_library(name: &str, picture: &str) -> String {
    format!("newmtl {name}\nKa 0 0 0\nKd 1 1 1\nKs 0 0 0\nillum 1\nmap_Kd {picture}\n")
}

/// How a picture lies, and its name, which is all behind the options.
fn map(mut rest: &str) -> Option<([[f32; 3]; 2], &str)> {
    let (mut offset, mut scale) = ([0.0f32; 2], [1.0f32; 2]);
    while rest.starts_with('-') {
        let (option, behind) = rest.split_once(char::is_whitespace)?;
        rest = behind.trim_start();
        let most = OPTIONS.iter().find(|(name, _)| *name == option).map(|(_, words)| *words)?;
        for k in 0..most {
            let (word, behind) = rest.split_once(char::is_whitespace).unwrap_or((rest, ""));
            let number = word.parse::<f32>().ok().filter(|x| x.is_finite());
            // The last word is the name.
            match (most == 3 && k > 0, behind.is_empty()) {
                (true, is_last) if is_last || number.is_none() => break,
                (false, true) => return None,
                _ => {}
            }
            rest = behind.trim_start();
            if let (Some(x), true) = (number, k < 2) {
                match option {
                    "-o" => offset[k] = x,
                    "-s" => scale[k] = x,
                    _ => {}
                }
            }
        }
    }
    let [u, v] = scale;
    // Scaled and moved, then turned.
    (!rest.is_empty()).then_some(([[u, 0.0, offset[0]], [0.0, -v, 1.0 - offset[1]]], rest))
}

/// Options of pictures and how many words follow; of three the last two may be left out.
const OPTIONS: [(&str, usize); 13] = [
    ("-blendu", 1),
    ("-blendv", 1),
    ("-boost", 1),
    ("-bm", 1),
    ("-cc", 1),
    ("-clamp", 1),
    ("-imfchan", 1),
    ("-texres", 1),
    ("-type", 1),
    ("-mm", 2),
    ("-o", 3),
    ("-s", 3),
    ("-t", 3),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_and_pictures() {
        let text = b"# by hand\nKd 9 9 9\nnewmtl a b \n\tKd 1.0 0 0.5 # red\nmap_Kd\tmy wood.png\nnewmtl black\r\nKd 0 0 0\n\
            map_Kd -clamp on -s 2 3 1 -o 0.25 c.jpg\nnewmtl none\nKd 0 0 0\nmap_Ka x.png\n";
        let read = read(text).unwrap();
        assert_eq!(read.iter().map(|m| &m.name[..]).collect::<Vec<_>>(), ["a b", "black", "none"]);
        assert_eq!(read[0].picture.as_deref(), Some("my wood.png"));
        assert_eq!(read[0].material.transform, TURNED);
        let [r, g, b, _] = read[0].material.colour;
        assert!(r == 1.0 && g == 0.0 && (b - 0.214).abs() < 1e-3);
        assert_eq!((read[1].material.colour, read[1].picture.as_deref()), ([1.0; 4], Some("c.jpg")));
        assert_eq!(read[1].material.transform, [[2.0, 0.0, 0.25], [0.0, -3.0, 1.0]]);
        assert_eq!((read[2].material.colour, &read[2].picture), ([0.0, 0.0, 0.0, 1.0], &None));
    }

    #[test]
    fn what_is_written_is_read_and_faults_have_lines() {
        let back = read(material_library("baked", "a map.png").as_bytes()).unwrap();
        assert_eq!((&back[0].name[..], back[0].picture.as_deref()), ("baked", Some("a map.png")));
        assert_eq!((back.len(), back[0].material.colour), (1, [1.0; 4]));
        for (text, fault) in
            [("Kd 1 x 1", "line 2: no colour: \"1 x 1\""), ("map_Kd -o 1", "line 2: no picture: \"-o 1\"")]
        {
            assert_eq!(read(format!("newmtl a\n{text}\n").as_bytes()).unwrap_err(), fault);
        }
    }
}
