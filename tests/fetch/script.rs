//! A server that follows a script: what it does with each request is up to the test.

use std::collections::HashMap;
use std::io::{BufRead, BufReader, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::{Arc, Mutex};
use std::thread;

/// What was asked.
#[derive(Clone, Debug)]
pub struct Asked {
    pub headers: HashMap<String, String>,
}

impl Asked {
    pub fn header(&self, name: &str) -> &str {
        self.headers.get(name).map_or("", String::as_str)
    }

    /// First and last byte asked for, as `Range` has them.
    pub fn range(&self) -> (usize, usize) {
        let range = self.header("range").strip_prefix("bytes=").unwrap();
        let (first, last) = range.split_once('-').unwrap();
        (first.parse().unwrap(), last.parse().unwrap_or(usize::MAX))
    }

    /// A good answer, of the version `tag`.
    pub fn answer(&self, file: &[u8], tag: &str) -> Vec<u8> {
        let if_range = self.header("if-range");
        if !if_range.is_empty() && if_range != tag {
            return whole(file, tag);
        }
        let (first, last) = self.range();
        if first >= file.len() {
            return format!(
                "HTTP/1.1 416 No\r\nContent-Range: bytes */{}\r\nContent-Length: 0\r\nETag: {tag}\r\n\r\n",
                file.len()
            )
            .into();
        }
        let last = last.min(file.len() - 1);
        let head = format!(
            "HTTP/1.1 206 Partial Content\r\nContent-Length: {}\r\nContent-Range: bytes {first}-{last}/{}\r\nETag: {tag}\r\n\r\n",
            last + 1 - first,
            file.len(),
        );
        [head.as_bytes(), &file[first..=last]].concat()
    }
}

/// The file as a server answers that knows no ranges.
pub fn whole(file: &[u8], tag: &str) -> Vec<u8> {
    let head = format!("HTTP/1.1 200 OK\r\nContent-Length: {}\r\nETag: {tag}\r\n\r\n", file.len());
    [head.as_bytes(), file].concat()
}

/// How long the head of an answer is.
pub fn head_length(answer: &[u8]) -> usize {
    answer.windows(4).position(|w| w == b"\r\n\r\n").unwrap() + 4
}

/// A server on a free port, for as long as the process lives.
#[derive(Clone)]
pub struct Script {
    pub address: SocketAddr,
    asked: Arc<Mutex<Vec<Asked>>>,
}

impl Script {
    /// `play` gets the number of the request, the request, and the connection, which is closed behind it.
    pub fn play(play: impl Fn(usize, &Asked, &mut TcpStream) + Send + Sync + 'static) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let script = Self { address: listener.local_addr().unwrap(), asked: Arc::default() };
        let (this, play) = (script.clone(), Arc::new(play));
        thread::spawn(move || {
            for stream in listener.incoming() {
                let (this, play, mut stream) = (this.clone(), play.clone(), stream.unwrap());
                thread::spawn(move || {
                    let Some(asked) = read(&stream) else { return };
                    let number = {
                        let mut all = this.asked.lock().unwrap();
                        all.push(asked.clone());
                        all.len() - 1
                    };
                    play(number, &asked, &mut stream);
                });
            }
        });
        script
    }

    /// Each answer is what `answer` makes of the number of the request and the request.
    pub fn answers(answer: impl Fn(usize, &Asked) -> Vec<u8> + Send + Sync + 'static) -> Self {
        Self::play(move |number, asked, stream| {
            // Who has enough hangs up.
            let _ = stream.write_all(&answer(number, asked));
        })
    }

    pub fn url(&self) -> String {
        format!("http://{}/a.uwm", self.address)
    }

    /// All requests so far.
    pub fn asked(&self) -> Vec<Asked> {
        self.asked.lock().unwrap().clone()
    }
}

fn read(stream: &TcpStream) -> Option<Asked> {
    let mut lines = BufReader::new(stream).lines().map_while(Result::ok).take_while(|line| !line.is_empty());
    lines.next()?;
    let headers = lines.filter_map(|line| {
        let (name, value) = line.split_once(':')?;
        Some((name.to_lowercase(), value.trim().to_owned()))
    });
    Some(Asked { headers: headers.collect() })
}
