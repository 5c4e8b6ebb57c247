//! Who may ask: by which name the server was called, and on behalf of which pages.
//!
//! A server on a loopback address is for the programs of one machine. A browser on it is one of them, and runs pages from anywhere: they must neither
//! read the answers (CORS) nor reach the server under a name of their own that leads to the address (DNS rebinding).

use std::net::IpAddr;
use std::time::Duration;

use axum::extract::Request;
use axum::http::uri::Authority;
use axum::http::{HeaderValue, Method, StatusCode, Version, header};
use tower_http::cors::{AllowOrigin, Any, CorsLayer};

use super::decide::Refusal;

/// Which pages from elsewhere may read answers. A page of the server's own address always may.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Origins {
    /// On a loopback address none, on another address all.
    #[default]
    Usual,
    /// All.
    Any,
    /// Those of these origins, such as `https://example.org:8443`.
    These(Vec<String>),
}

impl Origins {
    /// Origins from their names: `*` is any, `none` is none, others are scheme, host and port, as a browser tells them.
    ///
    /// # Errors
    /// What is wrong with the first that is none of these, or contradicts another.
    pub fn parse<'a>(names: impl IntoIterator<Item = &'a str>) -> Result<Self, String> {
        let names: Vec<&str> = names.into_iter().collect();
        match names[..] {
            [] => return Ok(Self::Usual),
            ["*"] => return Ok(Self::Any),
            ["none"] => return Ok(Self::These(Vec::new())),
            _ => {}
        }
        for &name in &names {
            if name == "*" || name == "none" {
                return Err(format!("{name} stands alone"));
            }
            let origin = url::Url::parse(name).map(|url| url.origin());
            let told = origin.as_ref().map(url::Origin::ascii_serialization);
            match told {
                Ok(told) if told == name => {}
                Ok(told) if told != "null" => return Err(format!("{name}: the origin of this is {told}")),
                _ => {
                    return Err(format!(
                        "{name}: no origin; one is like https://example.org or http://localhost:5173"
                    ));
                }
            }
        }
        Ok(Self::These(names.into_iter().map(str::to_owned).collect()))
    }

    /// What answers tell browsers; nothing where no page from elsewhere may read them.
    pub fn layer(&self, local: bool) -> Option<CorsLayer> {
        let allowed = match self {
            Self::Usual if local => return None,
            Self::Usual | Self::Any => AllowOrigin::from(Any),
            Self::These(origins) if origins.is_empty() => return None,
            Self::These(origins) => {
                AllowOrigin::list(origins.iter().filter_map(|origin| HeaderValue::from_str(origin).ok()))
            }
        };
        let headers =
            [header::AUTHORIZATION, header::RANGE, header::IF_RANGE, header::IF_MATCH, header::IF_NONE_MATCH];
        let layer = CorsLayer::new().allow_origin(allowed).allow_methods([Method::GET, Method::HEAD]);
        Some(layer.allow_headers(headers).expose_headers(Any).max_age(Duration::from_secs(86_400)))
    }
}

/// Sees whether a request tells one host (RFC 9112 §3.2), and on a loopback address one that is meant: a name or address of the machine itself, or one of
/// `hosts`; `*` among them is any.
///
/// # Errors
/// [`Refusal`].
pub fn check_host(request: &Request, local: bool, hosts: &[String]) -> Result<(), Refusal> {
    let refuse =
        |status, what: String| Refusal { field: Some("Host".to_owned()), ..Refusal::new(status, what) };
    let bad = |what: &str| Err(refuse(StatusCode::BAD_REQUEST, what.to_owned()));
    let mut lines = request.headers().get_all(header::HOST).iter();
    let line = match (lines.next(), lines.next()) {
        (Some(line), None) => line.as_bytes(),
        (Some(_), Some(_)) => return bad("a request has one header Host, this one has several"),
        (None, _) if request.version() < Version::HTTP_11 => return Ok(()),
        (None, _) => return bad("a request has a header Host"),
    };
    let told = match line {
        b"" => None,
        line => match Authority::try_from(line) {
            Ok(host) if !line.contains(&b'@') => Some(host),
            _ => return bad("the header Host is no host"),
        },
    };
    if !local || hosts.iter().any(|host| host == "*") {
        return Ok(());
    }
    // A proxy's request has a host in its first line, too.
    let asked = request.uri().authority().into_iter().chain(&told).map(Authority::host);
    match asked.clone().find(|host| !is_meant(host, hosts)) {
        None if told.is_some() => Ok(()),
        stranger => {
            let what = format!(
                "this server is on a loopback address and does not answer to the name {:?}; unweld serve --host NAME lets it",
                stranger.unwrap_or("")
            );
            Err(refuse(StatusCode::MISDIRECTED_REQUEST, what))
        }
    }
}

fn is_meant(host: &str, hosts: &[String]) -> bool {
    let bare = host.strip_prefix('[').and_then(|rest| rest.strip_suffix(']')).unwrap_or(host);
    let name = host.strip_suffix('.').unwrap_or(host);
    bare.parse::<IpAddr>().is_ok_and(|address| address.is_loopback())
        || name.eq_ignore_ascii_case("localhost")
        || hosts.iter().any(|known| known.eq_ignore_ascii_case(name))
}

#[cfg(test)]
mod tests {
    use super::*;
    use axum::body::Body;

    #[test]
    fn origins_by_their_names() {
        assert_eq!(Origins::parse([]), Ok(Origins::Usual));
        assert_eq!(Origins::parse(["*"]), Ok(Origins::Any));
        assert_eq!(Origins::parse(["none"]), Ok(Origins::These(vec![])));
        let two = ["https://example.org", "http://localhost:5173"];
        assert_eq!(Origins::parse(two), Ok(Origins::These(two.map(str::to_owned).to_vec())));
        for (name, what) in [
            ("https://example.org/", "the origin of this is https://example.org"),
            ("https://example.org:443", "the origin of this is https://example.org"),
            ("https://Example.org/x?y", "the origin of this is https://example.org"),
            ("example.org", "no origin"),
            ("null", "no origin"),
            ("file:///x", "no origin"),
            ("", "no origin"),
            ("https://a\r\nb: c", "no origin"),
        ] {
            let told = Origins::parse([name]).unwrap_err();
            assert!(told.contains(what), "{name}: {told}");
        }
        assert!(Origins::parse(["*", "https://example.org"]).is_err());
        assert!(Origins::parse(["https://example.org", "none"]).is_err());
    }

    #[test]
    fn hosts() {
        let known = ["meshes.example".to_owned()];
        let status = |lines: &[&str], local: bool| {
            let mut request = Request::builder().uri("/meshes");
            for line in lines {
                request = request.header("Host", *line);
            }
            match check_host(&request.body(Body::empty()).unwrap(), local, &known) {
                Ok(()) => 200,
                Err(refusal) => refusal.status.as_u16(),
            }
        };
        for host in [
            "localhost",
            "LOCALHOST:8080",
            "localhost.:1",
            "127.0.0.1",
            "127.0.0.1:80",
            "127.9.9.9",
            "[::1]",
            "[::1]:8080",
            "Meshes.Example:443",
        ] {
            assert_eq!((status(&[host], true), status(&[host], false)), (200, 200), "{host}");
        }
        for host in [
            "",
            "evil.example",
            "evil.example:8080",
            "localhost.evil.example",
            "127.0.0.1.evil.example",
            "192.168.0.1",
            "0.0.0.0",
            "[::2]",
        ] {
            assert_eq!((status(&[host], true), status(&[host], false)), (421, 200), "{host}");
        }
        for hosts in
            [&[] as &[&str], &["localhost", "localhost"], &["a b"], &["x@localhost"], &["http://localhost"]]
        {
            assert_eq!((status(hosts, true), status(hosts, false)), (400, 400), "{hosts:?}");
        }
    }
}
