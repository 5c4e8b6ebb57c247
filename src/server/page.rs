//! The viewer: files of `web/dist`, which `web/build` makes, as part of the program.

use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use headers::{ETag, HeaderMapExt, IfNoneMatch};

use super::packing::accepts;

/// A file of the page.
#[derive(Debug)]
pub struct File {
    /// Where it is served.
    pub path: &'static str,
    name: &'static str,
    media_type: &'static str,
    plain: &'static [u8],
    brotli: &'static [u8],
}

macro_rules! file {
    ($path:literal, $name:literal, $media_type:literal) => {
        File {
            path: $path,
            name: $name,
            media_type: $media_type,
            plain: include_bytes!(concat!("../../web/dist/", $name)),
            brotli: include_bytes!(concat!("../../web/dist/", $name, ".br")),
        }
    };
}

/// All files of the page.
pub const FILES: [File; 5] = [
    file!("/", "index.html", "text/html; charset=utf-8"),
    file!("/style.css", "style.css", "text/css; charset=utf-8"),
    file!("/viewer.js", "viewer.js", "text/javascript; charset=utf-8"),
    file!("/worker.js", "worker.js", "text/javascript; charset=utf-8"),
    file!("/unweld.wasm", "unweld.wasm", "application/wasm"),
];

/// Whether this is the path of a file of the page.
pub fn has(path: &str) -> bool {
    FILES.iter().any(|file| file.path == path)
}

impl File {
    /// The answer to a request with these headers: compressed where the client can read that, 304 where it has the file.
    pub fn answer(&self, request: &HeaderMap) -> Response {
        let (suffix, content) = match accepts(request, "br") {
            true => ("-br", self.brotli),
            false => ("", self.plain),
        };
        let mut headers = HeaderMap::new();
        let tag = format!("\"{}{suffix}\"", self.digest()).parse::<ETag>().ok();
        let known = tag.as_ref().zip(request.typed_get::<IfNoneMatch>());
        let fresh = known.is_none_or(|(tag, condition)| condition.precondition_passes(tag));
        if let Some(tag) = tag {
            headers.typed_insert(tag);
        }
        headers.insert(header::VARY, HeaderValue::from_static("Accept-Encoding"));
        headers.insert(header::CACHE_CONTROL, HeaderValue::from_static("no-cache"));
        if !fresh {
            return (StatusCode::NOT_MODIFIED, headers).into_response();
        }
        headers.insert(header::CONTENT_TYPE, HeaderValue::from_static(self.media_type));
        headers.insert(header::CONTENT_SECURITY_POLICY, HeaderValue::from_static(POLICY));
        headers.insert(header::X_CONTENT_TYPE_OPTIONS, HeaderValue::from_static("nosniff"));
        if !suffix.is_empty() {
            headers.insert(header::CONTENT_ENCODING, HeaderValue::from_static("br"));
        }
        (headers, content).into_response()
    }

    /// The first digits of its digest, as `web/build` has noted it.
    fn digest(&self) -> &'static str {
        let lines = include_str!("../../web/dist/FILES").lines().filter_map(|line| line.split_once("  ./"));
        lines
            .filter(|(_, name)| *name == self.name)
            .find_map(|(digest, _)| digest.get(..16))
            .unwrap_or("unknown")
    }
}

/// What the page may load: its own files, and meshes from anywhere. No page from elsewhere may show it in a frame: it asks for tokens.
const POLICY: &str = "default-src 'self'; script-src 'self' 'wasm-unsafe-eval'; img-src 'self' data:; connect-src * data: blob:; \
                      object-src 'none'; base-uri 'none'; form-action 'none'; frame-ancestors 'self'";

#[cfg(test)]
mod tests {
    use super::*;

    fn accepting(codings: &'static str) -> HeaderMap {
        HeaderMap::from_iter([(header::ACCEPT_ENCODING, HeaderValue::from_static(codings))])
    }

    #[test]
    fn each_file_and_each_coding_has_a_tag_of_its_own() {
        let mut tags = std::collections::BTreeSet::new();
        for file in &FILES {
            for request in [HeaderMap::new(), accepting("br")] {
                let response = file.answer(&request);
                let tag = response.headers()[header::ETAG].clone();
                assert!(tags.insert(tag.to_str().unwrap().to_owned()), "{tag:?}");
                assert_eq!(response.status(), StatusCode::OK);
                let mut again = request.clone();
                again.insert(header::IF_NONE_MATCH, tag);
                assert_eq!(file.answer(&again).status(), StatusCode::NOT_MODIFIED, "{}", file.path);
            }
            assert!(file.brotli.len() < file.plain.len() && file.digest().len() == 16);
        }
    }
}
