//! The page of the demonstration: a server of its folder, asked for everything once, and a browser that shows it.

use super::numbers::count;
use super::output::say;
use super::signals::stopped;
use anyhow::{Context, bail, ensure};
use std::io::{ErrorKind, Read, Write};
use std::net::{Ipv4Addr, SocketAddr, TcpStream};
use std::path::Path;
use std::time::Duration;
use unweld::server::{Options, Server};
use unweld::store::Store;

/// What is served, and where.
pub struct Page<'a> {
    /// The folder that is served.
    pub folder: &'a Path,
    /// Names of files in it, and what they hold.
    pub files: &'a [(&'a str, &'a [u8])],
    /// The address, if it must be a certain one.
    pub address: Option<SocketAddr>,
}

impl Page<'_> {
    /// Serves the page and sees that it and the files arrive as they are; then, if it is to `stay`, goes on until the process is
    /// interrupted, with a browser on it if it is to `open` one.
    ///
    /// # Errors
    /// Where the address cannot be had, and where something else arrives.
    pub fn show(&self, stay: bool, open: bool) -> anyhow::Result<()> {
        let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build()?;
        runtime.block_on(async {
            let server = self.bind().await?;
            let address = server.address()?;
            let (end, ended) = tokio::sync::oneshot::channel::<()>();
            let stop = stopped()?;
            let serving = tokio::spawn(server.run(async {
                tokio::select! {
                    () = stop => {}
                    _ = ended => {}
                }
            }));
            for (name, bytes) in self.files {
                let (name, bytes) = ((*name).to_owned(), bytes.to_vec());
                tokio::task::spawn_blocking(move || check(address, &name, &bytes)).await??;
            }
            let told: Vec<String> = self
                .files
                .iter()
                .map(|(name, bytes)| format!("{name} in {}", count(bytes.len() as u64, "byte")))
                .collect();
            say(&format!("Served both: the page, {}, arrive as they are\n", told.join(" and ")))?;
            if stay {
                say(&format!("Look at it: http://{address}/ (Ctrl-C stops it)\n"))?;
                if open {
                    // The address has been told: whoever sees no browser can open one.
                    let _ = webbrowser::open(&format!("http://{address}/"));
                }
            } else {
                // A server that has ended already needs no word.
                let _ = end.send(());
            }
            serving.await?;
            Ok(())
        })
    }

    async fn bind(&self) -> anyhow::Result<Server> {
        let store =
            Store::open(&self.folder.to_string_lossy()).with_context(|| self.folder.display().to_string())?;
        let usual = SocketAddr::from((Ipv4Addr::LOCALHOST, 8080));
        let address = self.address.unwrap_or(usual);
        match Server::bind(address, store.clone(), Options::default()).await {
            Err(error) if error.kind() == ErrorKind::AddrInUse && self.address.is_none() => {
                let any = SocketAddr::from((Ipv4Addr::LOCALHOST, 0));
                Ok(Server::bind(any, store, Options::default()).await?)
            }
            outcome => outcome.with_context(|| address.to_string()),
        }
    }
}

/// Asks for the page and a file as a client would.
fn check(address: SocketAddr, file: &str, bytes: &[u8]) -> anyhow::Result<()> {
    let page = get(address, "/")?;
    ensure!(page.starts_with(b"<!doctype html>"), "http://{address}/ is not the page");
    let path = format!("/meshes/{file}");
    ensure!(get(address, &path)? == bytes, "http://{address}{path} is not what the file holds");
    Ok(())
}

/// The body of an answer. It is not asked for by `client::Http`, which would go through a proxy that the environment names; HTTP 1.0
/// has no chunks, and its connections end.
fn get(address: SocketAddr, path: &str) -> anyhow::Result<Vec<u8>> {
    let url = || format!("http://{address}{path}");
    let mut stream = TcpStream::connect(address).with_context(url)?;
    stream.set_read_timeout(Some(PATIENCE))?;
    write!(stream, "GET {path} HTTP/1.0\r\nHost: {address}\r\n\r\n").with_context(url)?;
    let mut answer = Vec::new();
    stream.read_to_end(&mut answer).with_context(url)?;
    let status = answer.split(|b| *b == b'\r').next().unwrap_or_default();
    if status.get(8..13) != Some(b" 200 ") {
        bail!("{}: {}", url(), String::from_utf8_lossy(status));
    }
    let head = answer.windows(4).position(|four| four == b"\r\n\r\n").map_or(answer.len(), |at| at + 4);
    Ok(answer.split_off(head))
}

/// Whether a browser would be seen: not on a machine without a screen, where a browser for terminals might take this one.
pub fn may_open() -> bool {
    !cfg!(all(unix, not(target_os = "macos")))
        || ["DISPLAY", "WAYLAND_DISPLAY"]
            .iter()
            .any(|name| std::env::var_os(name).is_some_and(|value| !value.is_empty()))
}

const PATIENCE: Duration = Duration::from_secs(20);
