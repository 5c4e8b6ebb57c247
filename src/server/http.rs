//! HTTP: routes, headers and statuses (spec §12).

use std::sync::Arc;
use std::time::Instant;

use axum::Router;
use axum::body::Body;
use axum::extract::{Request, State};
use axum::http::request::Parts;
use axum::http::{HeaderMap, HeaderValue, Method, StatusCode, header};
use axum::middleware::{self, Next};
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use bytes::Bytes;
use futures_util::stream::{self, StreamExt};
use headers::{HeaderMapExt, LastModified};
use serde_json::{Value, json};
use subtle::ConstantTimeEq;

use super::body::{Piece, body};
use super::decide::{self, Condition, Query, Refusal, Slice, Target, Wanted};
use super::library::{Library, Unreadable};
use super::metrics::{self, Metrics};
use super::packing::{Coding, compressed};
use super::{MEDIA_TYPE, Options, access, page};
use crate::store::{Fault, Object, Store};

/// What all requests share.
#[derive(Debug)]
pub struct App {
    pub store: Store,
    pub options: Options,
    pub metrics: Arc<Metrics>,
    library: Library,
    /// Whether the address is one that only this machine can reach.
    local: bool,
}

impl App {
    pub fn new(store: Store, options: Options, local: bool) -> Self {
        let metrics = Arc::new(Metrics::new(&store));
        Self { store, options, metrics, library: Library::new(), local }
    }
}

/// All routes.
pub fn router(app: Arc<App>) -> Router {
    let page = page::FILES.iter().fold(Router::new(), |router, file| {
        router.route(file.path, get(async |headers: HeaderMap| file.answer(&headers)))
    });
    let routes = page
        .route("/meshes", get(list))
        .route("/meshes/{*rest}", get(mesh))
        .route("/openapi.json", get(description))
        .route("/metrics", get(measured))
        .route("/healthz", get(async || "ok\n"))
        .fallback(other)
        .layer(middleware::from_fn_with_state(app.clone(), admit));
    let routes = match app.options.origins.layer(app.local) {
        Some(cors) => routes.layer(cors),
        None => routes,
    };
    routes
        .layer(middleware::from_fn_with_state(app.clone(), called))
        .layer(middleware::from_fn_with_state(app.clone(), observe))
        .with_state(app)
}

/// Counts and logs every request.
async fn observe(State(app): State<Arc<App>>, request: Request, next: Next) -> Response {
    let start = Instant::now();
    let (method, uri) = (request.method().clone(), request.uri().clone());
    let response = next.run(request).await;
    let status = response.status().as_u16();
    let seconds = start.elapsed().as_secs_f64();
    let route = match uri.path() {
        path if page::has(path) => "page",
        "/meshes" => "list",
        "/metrics" => "metrics",
        "/healthz" => "health",
        "/openapi.json" => "description",
        path => match path.strip_prefix("/meshes/").map(|rest| rest.rsplit('/').next().unwrap_or(rest)) {
            Some("levels") => "levels",
            Some("refine") => "refine",
            Some(last) if last.ends_with(".uwm") => "file",
            Some(_) if path.contains("/keyframe/") => "keyframe",
            _ => "other",
        },
    };
    app.metrics.requests.get_or_create(&metrics::Request { route, status }).inc();
    app.metrics.seconds.observe(seconds);
    // What was asked for is told in its encoded form: no control character comes into the log.
    tracing::info!(%method, %uri, status, seconds, "request");
    response
}

/// Lets through who calls the server by a name that it answers to.
async fn called(State(app): State<Arc<App>>, request: Request, next: Next) -> Response {
    match access::check_host(&request, app.local, &app.options.hosts) {
        Ok(()) => next.run(request).await,
        Err(refusal) => problem(refusal),
    }
}

/// Lets through who has a token, where one is needed; anybody may ask how the server is, and for the page, which asks for the token.
async fn admit(State(app): State<Arc<App>>, request: Request, next: Next) -> Response {
    let tokens = &app.options.tokens;
    let sent = request.headers().get(header::AUTHORIZATION).map(HeaderValue::as_bytes);
    let sent = sent
        .and_then(|value| value.split_first_chunk::<7>())
        .filter(|(scheme, _)| scheme.eq_ignore_ascii_case(b"Bearer "));
    // All are compared, whichever fits: the time tells nothing but lengths.
    let known = sent.is_some_and(|(_, token)| {
        tokens.iter().fold(false, |found, known| found | bool::from(known.as_bytes().ct_eq(token)))
    });
    if tokens.is_empty() || known || is_open(request.uri().path()) {
        return next.run(request).await;
    }
    let what = if sent.is_some() {
        "this token is not known here"
    } else {
        "a token is needed: Authorization: Bearer TOKEN"
    };
    let mut response = problem(Refusal {
        field: Some("Authorization".to_owned()),
        ..Refusal::new(StatusCode::UNAUTHORIZED, what)
    });
    response.headers_mut().insert(header::WWW_AUTHENTICATE, HeaderValue::from_static("Bearer"));
    response
}

fn is_open(path: &str) -> bool {
    path == "/healthz" || page::has(path)
}

async fn other() -> Response {
    problem(Refusal::new(StatusCode::NOT_FOUND, "there is nothing of this name"))
}

async fn description(request: Request) -> Response {
    let text = compressed(include_bytes!("openapi.json").to_vec(), Coding::asked(request.headers()));
    ([(header::CONTENT_TYPE, "application/json")], text).into_response()
}

async fn measured(State(app): State<Arc<App>>) -> Response {
    let media_type = "application/openmetrics-text; version=1.0.0; charset=utf-8";
    ([(header::CONTENT_TYPE, media_type)], app.metrics.text()).into_response()
}

async fn list(State(app): State<Arc<App>>, request: Request) -> Result<Response, Answered> {
    if !app.options.list {
        return Err(Refusal::new(StatusCode::NOT_FOUND, "the names of the meshes are not told here").into());
    }
    let query = Query::parse(request.uri().query(), &["after", "limit"])?;
    let limit = query.limit.unwrap_or(LIST_NAMES);
    let (names, more) = app.store.names(query.names_after.as_deref().unwrap_or(""), limit).await?;
    let next = names.last().filter(|_| more).cloned();
    // One that cannot be read is told beside the others; one that has gone since its name was read is not.
    let entry = async |name: String| match levels(&app, &name).await {
        Ok(levels) => Some(levels),
        Err(Unreadable::Store(Fault::Absent)) => None,
        Err(unreadable) => {
            let error = told(unreadable).detail;
            Some(json!({ "name": name, "error": error }).to_string().into())
        }
    };
    let meshes: Vec<Bytes> =
        stream::iter(names).map(entry).buffered(4).filter_map(std::future::ready).collect().await;
    let coding = Coding::asked(request.headers());
    // Of many levels it takes a while.
    let text = tokio::task::spawn_blocking(move || {
        let (meshes, next) = (meshes.join(&b","[..]), json!(next).to_string());
        let parts = [&b"{\"meshes\":["[..], &meshes, b"],\"next\":", next.as_bytes(), b"}"];
        compressed(parts.concat(), coding)
    });
    let text = text.await.map_err(|e| Fault::Unavailable(e.to_string()))?;
    Ok(([(header::CACHE_CONTROL, "no-cache"), (header::CONTENT_TYPE, "application/json")], text)
        .into_response())
}

async fn levels(app: &App, name: &str) -> Result<Bytes, Unreadable> {
    let object = app.store.object(name).await?;
    app.library.levels(name, &object).await
}

async fn mesh(State(app): State<Arc<App>>, request: Request) -> Result<Response, Answered> {
    let (request, _) = request.into_parts();
    let path = request.uri.path().strip_prefix("/meshes/").unwrap_or("");
    let (name, target) = decide::target(path)?;
    let query = Query::parse(request.uri.query(), target.queries())?;
    let mut outcome = Err(Refusal::from(Fault::Changed).into());
    // A mesh that is replaced just now is opened again.
    for _ in 0..2 {
        outcome = answer(&app, &request, &name, target, &query).await;
        if !matches!(&outcome, Err(Answered::Changed)) {
            break;
        }
    }
    outcome
}

async fn answer(
    app: &App,
    request: &Parts,
    name: &str,
    target: Target,
    query: &Query,
) -> Result<Response, Answered> {
    let object = app.store.object(name).await?;
    if let Some(wanted) = query.version.as_ref().filter(|wanted| **wanted != object.version.tag) {
        let what = format!(
            "version {} is gone; the version there is is {}",
            wanted.escape_default(),
            object.version.tag
        );
        return Err(Refusal { field: Some("v".to_owned()), ..Refusal::new(StatusCode::GONE, what) }.into());
    }
    let headers = version_headers(app, &object, query.version.is_some());
    match decide::condition(&request.headers, &object.version) {
        Condition::Met => {}
        Condition::NotModified => return Ok((StatusCode::NOT_MODIFIED, headers).into_response()),
        Condition::Failed => {
            let what = format!("the version there is is {}", object.version.tag);
            return Ok(
                (headers, problem(Refusal::new(StatusCode::PRECONDITION_FAILED, what))).into_response()
            );
        }
    }
    if target == Target::File {
        let all = Slice { atoms: 0..0, bytes: 0..object.version.bytes, level: 0 };
        return send(app, request, &object, headers, &all).await;
    }
    if target == Target::Levels {
        let text = app.library.levels(name, &object).await?;
        return Ok((headers, [(header::CONTENT_TYPE, "application/json")], text).into_response());
    }
    let contents = app.library.contents(name, &object).await?;
    let slice = match target {
        Target::Keyframe(level) => decide::keyframe(&contents, level)?,
        _ => decide::refine(&contents, query)?,
    };
    decide::check_extent(&contents, &slice, object.version.bytes)?;
    let mut headers = headers;
    let [atoms, bytes] =
        [(slice.atoms.start as u64, slice.atoms.end as u64), (slice.bytes.start, slice.bytes.end)]
            .map(|(start, end)| HeaderValue::try_from(format!("{start}-{end}")).ok());
    headers.extend(
        [("unweld-atoms", atoms), ("unweld-bytes", bytes), ("unweld-level", Some(slice.level.into()))]
            .into_iter()
            .filter_map(|(name, value)| Some((header::HeaderName::from_static(name), value?))),
    );
    send(app, request, &object, headers, &slice).await
}

/// What every answer about a version tells.
fn version_headers(app: &App, object: &Object, pinned: bool) -> HeaderMap {
    let mut headers = HeaderMap::new();
    let scope = if app.options.tokens.is_empty() { "public" } else { "private" };
    let caching = match (pinned, app.options.max_age) {
        (true, _) => format!("{scope}, max-age=31536000, immutable"),
        (false, 0) => "no-cache".to_owned(),
        (false, age) => format!("{scope}, max-age={age}, must-revalidate"),
    };
    let texts = [(header::ETAG, format!("\"{}\"", object.version.tag)), (header::CACHE_CONTROL, caching)];
    for (name, text) in texts {
        headers.extend(HeaderValue::try_from(text).ok().map(|value| (name, value)));
    }
    headers.typed_insert(LastModified::from(object.version.modified));
    headers
}

/// Sends bytes of a version, or the ranges of them that were asked for.
async fn send(
    app: &App,
    request: &Parts,
    object: &Object,
    mut headers: HeaderMap,
    slice: &Slice,
) -> Result<Response, Answered> {
    let length = slice.bytes.end - slice.bytes.start;
    headers.insert(header::ACCEPT_RANGES, HeaderValue::from_static("bytes"));
    let wanted = match request.method {
        Method::GET => decide::wanted(&request.headers, &object.version, length),
        _ => Wanted::Whole,
    };
    let mut media_type = MEDIA_TYPE.to_owned();
    let mut status = StatusCode::PARTIAL_CONTENT;
    let shifted = |range: &std::ops::Range<u64>| {
        Piece::Object(slice.bytes.start + range.start..slice.bytes.start + range.end)
    };
    let content_range =
        |range: &std::ops::Range<u64>| format!("bytes {}-{}/{length}", range.start, range.end - 1);
    let pieces = match wanted {
        Wanted::Whole => {
            status = StatusCode::OK;
            vec![Piece::Object(slice.bytes.clone())]
        }
        Wanted::Ranges(ranges) => match &ranges[..] {
            [range] => {
                headers.extend(
                    HeaderValue::try_from(content_range(range)).ok().map(|v| (header::CONTENT_RANGE, v)),
                );
                vec![shifted(range)]
            }
            ranges => {
                media_type = format!("multipart/byteranges; boundary={BOUNDARY}");
                let head = |range| {
                    format!(
                        "\r\n--{BOUNDARY}\r\nContent-Type: {MEDIA_TYPE}\r\nContent-Range: {}\r\n\r\n",
                        content_range(range)
                    )
                };
                let parts = ranges.iter().flat_map(|range| [Piece::Text(head(range).into()), shifted(range)]);
                parts.chain([Piece::Text(Bytes::from(format!("\r\n--{BOUNDARY}--\r\n")))]).collect()
            }
        },
        Wanted::Unsatisfiable => {
            let what = format!(
                "there are {length} bytes, and at most {} ranges that do not overlap are served",
                decide::MAX_RANGES
            );
            let refusal = Refusal {
                field: Some("Range".to_owned()),
                ..Refusal::new(StatusCode::RANGE_NOT_SATISFIABLE, what)
            };
            headers.remove(header::CACHE_CONTROL);
            headers.extend(
                HeaderValue::try_from(format!("bytes */{length}")).ok().map(|v| (header::CONTENT_RANGE, v)),
            );
            return Ok((headers, problem(refusal)).into_response());
        }
    };
    headers.insert(header::CONTENT_LENGTH, pieces.iter().map(Piece::bytes).sum::<u64>().into());
    headers.extend(HeaderValue::try_from(media_type).ok().map(|v| (header::CONTENT_TYPE, v)));
    let body = match request.method {
        Method::GET => body(object, pieces, &app.metrics).await?,
        _ => Body::empty(),
    };
    Ok((status, headers, body).into_response())
}

/// A request that ends otherwise than it was meant.
#[derive(Debug)]
enum Answered {
    /// For good.
    Refused(Refusal),
    /// Another version took the place of the one that was opened: it may be tried again.
    Changed,
}

impl From<Refusal> for Answered {
    fn from(refusal: Refusal) -> Self {
        Self::Refused(refusal)
    }
}

impl From<Fault> for Answered {
    fn from(fault: Fault) -> Self {
        if fault == Fault::Changed { Self::Changed } else { Self::Refused(told(Unreadable::Store(fault))) }
    }
}

impl From<Unreadable> for Answered {
    fn from(unreadable: Unreadable) -> Self {
        match unreadable {
            Unreadable::Store(fault) => fault.into(),
            other => Self::Refused(told(other)),
        }
    }
}

/// The refusal that this leads to. What it leaves out is told to the log: it may have paths in it that are nobody's affair.
fn told(unreadable: Unreadable) -> Refusal {
    if let Unreadable::Store(Fault::Refused(why) | Fault::Unavailable(why)) = &unreadable {
        tracing::warn!(fault = %unreadable, why = ?why, "a store failed");
    }
    unreadable.into()
}

impl IntoResponse for Answered {
    fn into_response(self) -> Response {
        match self {
            Self::Refused(refusal) => problem(refusal),
            Self::Changed => problem(Fault::Changed.into()),
        }
    }
}

/// An error as RFC 9457 has it.
fn problem(refusal: Refusal) -> Response {
    let Refusal { status, field, detail } = refusal;
    let title = status.canonical_reason().unwrap_or("");
    let mut text = json!({ "title": title, "status": status.as_u16(), "detail": detail });
    if let (Some(field), Value::Object(text)) = (field, &mut text) {
        text.insert("field".to_owned(), field.into());
    }
    let kind = [(header::CONTENT_TYPE, "application/problem+json")];
    let mut response = (status, kind, text.to_string()).into_response();
    if !matches!(status, StatusCode::PRECONDITION_FAILED | StatusCode::RANGE_NOT_SATISFIABLE) {
        response.headers_mut().insert(header::CACHE_CONTROL, HeaderValue::from_static("no-store"));
    }
    if status == StatusCode::SERVICE_UNAVAILABLE {
        response.headers_mut().insert(header::RETRY_AFTER, HeaderValue::from_static("2"));
    }
    response
}

/// Between the parts of an answer of several ranges. No part is searched for it: each tells its length.
const BOUNDARY: &str = "unweld-3f6b0c5e9a1d47f28e";
const LIST_NAMES: usize = 100;
