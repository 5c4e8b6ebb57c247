//! What a file is that is none of the formats that are read, told by its first bytes.

use super::text::{self, byte_order_mark};

/// What the content is, with its article: for messages about a file that could not be read. Nothing is asked of a file that can.
pub(super) fn named(bytes: &[u8]) -> Option<&'static str> {
    let begins = |(first, _): &&(&[u8], &str)| bytes.starts_with(first);
    if let Some((_, what)) = BINARY.iter().find(begins) {
        return Some(what);
    }
    if bytes.starts_with(b"PK\x03\x04") {
        return Some(if contains(bytes, b"3D/3dmodel.model") || contains(bytes, b"3dmodel") {
            "a 3MF file"
        } else {
            "a zip archive"
        });
    }
    // Text of two bytes a character, with its mark or without.
    let utf16 = |bytes: &[u8], zero: usize| {
        let pairs = bytes[..bytes.len().min(LOOKED_AT)].chunks_exact(2);
        pairs.len() >= 4 && pairs.clone().all(|pair| pair[zero] == 0 && pair[1 - zero] != 0)
    };
    if bytes.starts_with(b"\xff\xfe") || bytes.starts_with(b"\xfe\xff") || utf16(bytes, 0) || utf16(bytes, 1)
    {
        return Some("text in UTF-16, not in UTF-8");
    }
    if !text::is_text(bytes) {
        return None;
    }
    let text = bytes[byte_order_mark(bytes)..].trim_ascii_start();
    let begins = |(first, _): &&(&[u8], &str)| {
        text.split_at_checked(first.len()).is_some_and(|(start, _)| start.eq_ignore_ascii_case(first))
    };
    if let Some((_, what)) = TEXT.iter().find(begins) {
        return Some(what);
    }
    match text.first()? {
        b'{' | b'[' => Some("JSON"),
        b'<' => {
            XML.iter().find(|(element, _)| contains(text, element)).map(|(_, what)| *what).or(Some("XML"))
        }
        _ => None,
    }
}

/// Whether some bytes are among the first ones.
fn contains(bytes: &[u8], what: &[u8]) -> bool {
    let first = &bytes[..bytes.len().min(LOOKED_AT)];
    first.windows(what.len()).any(|window| window.eq_ignore_ascii_case(what))
}

const LOOKED_AT: usize = 4096;

/// First bytes of files that are not text.
const BINARY: [(&[u8], &str); 22] = [
    (b"\x89UWM", "a .uwm file, which is coded already"),
    (b"DRACO", "a Draco file"),
    (b"Kaydara FBX Binary", "an FBX file"),
    (b"BLENDER", "a Blender file"),
    (b"3D Geometry File Format", "a Rhino file"),
    (b"PXR-USDC", "a USD file"),
    (b"Ogawa", "an Alembic file"),
    (b"LASF", "a LAS file"),
    (b"OCTM", "an OpenCTM file"),
    (b"OpenCTM", "an OpenCTM file"),
    (b"\x89HDF", "an HDF5 file"),
    (b"\x89PNG", "a PNG picture"),
    (b"\xff\xd8\xff", "a JPEG picture"),
    (b"%PDF", "a PDF file"),
    (b"\x7fELF", "a program"),
    (b"\x28\xb5\x2f\xfd", "a zstd archive"),
    (b"\xfd7zXZ", "an xz archive"),
    (b"BZh", "a bzip2 archive"),
    (b"7z\xbc\xaf", "a 7z archive"),
    (b"Rar!", "a RAR archive"),
    (b"PK\x05\x06", "an empty zip archive"),
    (b"\x1f\x8b", "a gzip archive within a gzip archive"),
];

/// First words of files that are text, in any case.
const TEXT: [(&[u8], &str); 16] = [
    (b"version https://git-lfs", "a Git LFS pointer, not the file it stands for"),
    (b"<!doctype html", "an HTML page"),
    (b"<html", "an HTML page"),
    (b"; FBX", "an FBX file in text"),
    (b"#usda", "a USD file"),
    (b"#VRML", "a VRML file"),
    (b"#X3D", "an X3D file"),
    (b"# vtk DataFile", "a VTK file"),
    (b"# .PCD", "a PCD file"),
    (b"VERSION .7", "a PCD file"),
    (b"$MeshFormat", "a Gmsh file"),
    (b"MeshVersionFormatted", "a Medit file"),
    (b"ISO-10303-21", "a STEP file"),
    (b"xof 0", "a DirectX file"),
    (b"%YAML", "YAML"),
    (b"%!PS", "PostScript"),
];

/// What elements of XML tell.
const XML: [(&[u8], &str); 8] = [
    (b"<html", "an HTML page"),
    (b"<COLLADA", "a COLLADA file"),
    (b"<X3D", "an X3D file"),
    (b"<amf", "an AMF file"),
    (b"<VTKFile", "a VTK file"),
    (b"<svg", "an SVG picture"),
    (b"<MeshLabProject", "a MeshLab project"),
    (b"3dmanufacturing", "the model of a 3MF file"),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_of_other_kinds() {
        let utf16 =
            |order: fn(u16) -> [u8; 2], text: &str| text.encode_utf16().flat_map(order).collect::<Vec<u8>>();
        for (bytes, what) in [
            (b"DRACO\x02\x02\x01\x01\0\0".to_vec(), "a Draco file"),
            (b"{\"name\": 1}".to_vec(), "JSON"),
            (
                b"PK\x03\x04\x14\0\0\0\x08\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\x10\0\0\x003D/3dmodel.model"
                    .to_vec(),
                "a 3MF file",
            ),
            (b"PK\x03\x04\x14\0\0\0\x08\0".to_vec(), "a zip archive"),
            (b"Kaydara FBX Binary  \0\x1a\0".to_vec(), "an FBX file"),
            (b"; FBX 7.3.0 project file\n".to_vec(), "an FBX file in text"),
            (b"\n<!DOCTYPE HTML>\n<html>".to_vec(), "an HTML page"),
            (b"<?xml version=\"1.0\"?><COLLADA>".to_vec(), "a COLLADA file"),
            (b"<?xml version=\"1.0\"?>".to_vec(), "XML"),
            (
                b"version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 12\n".to_vec(),
                "a Git LFS pointer, not the file it stands for",
            ),
            (utf16(u16::to_le_bytes, "\u{feff}solid a\n"), "text in UTF-16, not in UTF-8"),
            (utf16(u16::to_be_bytes, "\u{feff}solid a\n"), "text in UTF-16, not in UTF-8"),
            (utf16(u16::to_le_bytes, "solid a\n"), "text in UTF-16, not in UTF-8"),
            (utf16(u16::to_be_bytes, "solid a\n"), "text in UTF-16, not in UTF-8"),
            (b"\x89UWM\r\n\x1a\n".to_vec(), "a .uwm file, which is coded already"),
        ] {
            assert_eq!(named(&bytes), Some(what), "{:?}", String::from_utf8_lossy(&bytes));
        }
        for none in [
            &b""[..],
            b"solid a\n",
            b"v 1 2 3\n",
            b"OFF\n1 2 3\n",
            b"ply\n",
            b"\0\0\0\0\0\0\0\0\0",
            b"\x01\0",
            b"what",
        ] {
            assert_eq!(named(none), None, "{none:?}");
        }
    }
}
