//! Where a glTF's buffers are: data URIs (RFC 2397) and files beside it.

use std::path::{Component, Path, PathBuf};

/// What a URI stands for.
pub(super) enum Uri {
    /// Bytes that it has in itself.
    Data(Vec<u8>),
    /// A file, relative to the glTF's folder and within it.
    File(PathBuf),
}

/// What a URI stands for.
///
/// # Errors
/// Why it cannot be had, in words for the user.
pub(super) fn resolve(uri: &str) -> Result<Uri, String> {
    if let Some(data) = strip_prefix(uri, "data:") {
        let (media, text) = data.split_once(',').ok_or("a data URI without a comma")?;
        let encoded = media.rsplit(';').next().is_some_and(|last| last.eq_ignore_ascii_case("base64"));
        let plain = unescape(text)?;
        return Ok(Uri::Data(if encoded { base64(&plain)? } else { plain }));
    }
    // A scheme is letters before a colon; one letter is a drive.
    let scheme = uri.split_once(':').filter(|(scheme, _)| {
        !scheme.is_empty() && scheme.bytes().all(|b| b.is_ascii_alphanumeric() || b"+-.".contains(&b))
    });
    if let Some((scheme, _)) = scheme {
        return Err(format!("a URI of scheme `{scheme}`: only files beside the glTF and data URIs are read"));
    }
    let path = String::from_utf8(unescape(uri)?).map_err(|_| "a URI that is not UTF-8")?;
    let path = PathBuf::from(path);
    let below = path.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir));
    if !below || path.as_os_str().is_empty() || uri.contains('\\') {
        return Err("a file that is not below the glTF's own folder".to_owned());
    }
    Ok(Uri::File(path))
}

/// Where a file within a folder lies.
///
/// # Errors
/// Where it is not there, or a link leads out of the folder.
pub(in crate::formats) fn within(folder: &Path, file: &Path) -> Result<PathBuf, String> {
    let real = |path: &Path| path.canonicalize().map_err(|e| format!("{}: {e}", path.display()));
    // The folder of a name without one is the empty path.
    let folder = real(if folder.as_os_str().is_empty() { Path::new(".") } else { folder })?;
    let path = real(&folder.join(file))?;
    if !path.starts_with(&folder) {
        return Err("a link that leads out of the file's own folder".to_owned());
    }
    Ok(path)
}

fn strip_prefix<'a>(text: &'a str, prefix: &str) -> Option<&'a str> {
    let (first, rest) = text.split_at_checked(prefix.len())?;
    first.eq_ignore_ascii_case(prefix).then_some(rest)
}

/// Bytes written as `%20` (RFC 3986).
pub(super) fn unescape(text: &str) -> Result<Vec<u8>, String> {
    let mut bytes = Vec::with_capacity(text.len());
    let mut rest = text.as_bytes();
    while let Some((&first, behind)) = rest.split_first() {
        rest = behind;
        if first == b'%' {
            let digits =
                behind.first_chunk::<2>().map(|pair| pair.map(|digit| char::from(digit).to_digit(16)));
            let Some([Some(high), Some(low)]) = digits else {
                return Err("a URI with `%` before what is no hexadecimal number".to_owned());
            };
            bytes.push((16 * high + low) as u8);
            rest = &behind[2..];
        } else {
            bytes.push(first);
        }
    }
    Ok(bytes)
}

/// Base64 (RFC 4648), also of the alphabet for URIs, padded or not.
fn base64(text: &[u8]) -> Result<Vec<u8>, String> {
    let padding = text.iter().rev().take(2).take_while(|&&b| b == b'=').count();
    let text = &text[..text.len() - padding];
    let mut bytes = Vec::with_capacity(text.len() / 4 * 3 + 2);
    let (mut bits, mut held) = (0u32, 0);
    for (k, &letter) in text.iter().enumerate() {
        let digit = match letter {
            b'A'..=b'Z' => letter - b'A',
            b'a'..=b'z' => letter - b'a' + 26,
            b'0'..=b'9' => letter - b'0' + 52,
            b'+' | b'-' => 62,
            b'/' | b'_' => 63,
            _ => return Err(format!("letter {k} of the base64 data is none of base64")),
        };
        bits = bits << 6 | u32::from(digit);
        held += 6;
        if held >= 8 {
            held -= 8;
            bytes.push((bits >> held) as u8);
        }
    }
    if text.len() % 4 == 1 {
        return Err("the base64 data end within a byte".to_owned());
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn data(uri: &str) -> Result<Vec<u8>, String> {
        match resolve(uri)? {
            Uri::Data(bytes) => Ok(bytes),
            Uri::File(path) => Err(format!("file {}", path.display())),
        }
    }

    #[test]
    fn data_uris() {
        // Those of RFC 4648, §10.
        for (text, plain) in [
            ("", ""),
            ("Zg==", "f"),
            ("Zm8=", "fo"),
            ("Zm9v", "foo"),
            ("Zm9vYg", "foob"),
            ("Zm9vYmE%3D", "fooba"),
        ] {
            let uri = format!("data:application/octet-stream;base64,{text}");
            assert_eq!(data(&uri), Ok(plain.as_bytes().to_vec()));
        }
        assert_eq!(data("DATA:;BASE64,-_-_"), Ok(vec![0xfb, 0xff, 0xbf]));
        assert_eq!(data("data:,a%20b"), Ok(b"a b".to_vec()));
        assert_eq!(
            data("data:;base64,Zm 9"),
            Err("letter 2 of the base64 data is none of base64".to_owned())
        );
        assert_eq!(data("data:;base64,Z"), Err("the base64 data end within a byte".to_owned()));
        assert_eq!(data("data:;base64"), Err("a data URI without a comma".to_owned()));
    }

    #[test]
    fn files_are_below_the_folder() {
        assert_eq!(data("a%20b/c.bin"), Err("file a b/c.bin".to_owned()));
        assert_eq!(data("./c.bin"), Err("file ./c.bin".to_owned()));
        let outside = Err("a file that is not below the glTF's own folder".to_owned());
        for uri in ["../c.bin", "a/../../c.bin", "/etc/passwd", "%2e%2e/c", "%2Fetc", "", "..\\c"] {
            assert_eq!(data(uri), outside, "{uri}");
        }
        let scheme = "a URI of scheme `https`: only files beside the glTF and data URIs are read";
        assert_eq!(data("https://a/b.bin"), Err(scheme.to_owned()));
        assert!(data("c%zz").is_err() && data("c%").is_err() && data("%ff").is_err());
    }

    #[test]
    fn links_stay_inside() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("in")).unwrap();
        std::fs::write(folder.path().join("out.bin"), b"x").unwrap();
        std::fs::write(folder.path().join("in/a.bin"), b"x").unwrap();
        let inner = folder.path().join("in");
        assert!(within(&inner, Path::new("a.bin")).is_ok());
        assert!(within(&inner, Path::new("b.bin")).unwrap_err().contains("b.bin"));
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink("../out.bin", inner.join("link.bin")).unwrap();
            let error = within(&inner, Path::new("link.bin")).unwrap_err();
            assert_eq!(error, "a link that leads out of the file's own folder");
        }
    }
}
