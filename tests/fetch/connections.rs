//! The HTTP source: connections that break, servers that mislead.

use std::io::{Read, Write};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use unweld::Error;
use unweld::client::{FIRST_BYTES, Fault, Http, HttpOptions, Piece, Transfer, whole_file};
use unweld::container::{Contents, Plan, Want, plan};

use super::coded;
use super::script::{Asked, Script, head_length, whole};

fn options() -> HttpOptions {
    HttpOptions {
        pause: Duration::from_millis(1),
        timeout: Duration::from_secs(20),
        ..HttpOptions::default()
    }
}

type Outcome = (Vec<u8>, unweld::Result<()>, u64);

/// What a transfer brings, how it ends, and how many bytes came for that.
fn fetched(script: &Script, first: u64, planner: fn(&Contents) -> Plan) -> Outcome {
    fetched_with(script, options(), first, planner)
}

fn fetched_with(
    script: &Script,
    options: HttpOptions,
    first: u64,
    planner: fn(&Contents) -> Plan,
) -> Outcome {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    runtime.block_on(async {
        let source = Http::new(&script.url(), options).unwrap();
        let mut transfer = Transfer::new(source, first, |contents: &Contents| Ok(planner(contents)));
        let mut bytes = Vec::new();
        loop {
            match transfer.next().await {
                Ok(Some(Piece::Head { bytes: piece, .. } | Piece::Atom { bytes: piece, .. })) => {
                    bytes.extend(piece)
                }
                Ok(None) => return (bytes, Ok(()), transfer.source().received()),
                Err(error) => return (bytes, Err(error), transfer.source().received()),
            }
        }
    })
}

fn fault(outcome: Outcome) -> Fault {
    let error = outcome.1.unwrap_err();
    Fault::of(&error).unwrap_or_else(|| panic!("{error}")).clone()
}

fn third(contents: &Contents) -> Plan {
    plan(contents, Want::Level(3))
}

const TAG: &str = "\"one\"";

#[test]
fn ranges_that_are_needed_and_no_others() {
    let (file, contents) = coded(1);
    let served = file.clone();
    let script = Script::answers(move |_, asked| asked.answer(&served, TAG));
    let end = contents.bytes(contents.steps(3)).end;
    let (bytes, outcome, received) = fetched(&script, 100, third);
    outcome.unwrap();
    assert_eq!((&bytes[..], received), (&file[..end as usize], end));
    let asked = script.asked();
    // The beginning, the rest of the table, the atoms.
    let table = contents.header.table_end() as usize;
    let ranges: Vec<_> = asked.iter().map(|asked| asked.range()).collect();
    assert_eq!(ranges, [(0, 99), (100, table - 1), (table, end as usize - 1)]);
    let conditions: Vec<_> = asked.iter().map(|asked| asked.header("if-range")).collect();
    assert_eq!(conditions, ["", TAG, TAG]);
}

#[test]
fn a_server_that_ignores_ranges_is_cut_short() {
    let (file, contents) = coded(1);
    let end = contents.bytes(contents.steps(3)).end;
    let (sent, hung_up) = (Arc::new(AtomicUsize::new(0)), Arc::new(AtomicUsize::new(0)));
    let (count, flag, served) = (sent.clone(), hung_up.clone(), file.clone());
    let script = Script::play(move |_, _, stream| {
        // A terabyte, of which the file is the beginning.
        stream
            .write_all(b"HTTP/1.1 200 OK\r\nContent-Length: 1099511627776\r\nETag: \"one\"\r\n\r\n")
            .unwrap();
        stream.write_all(&served).unwrap();
        let noise = [7; 65536];
        while stream.write_all(&noise).is_ok() {
            count.fetch_add(noise.len(), Ordering::SeqCst);
        }
        flag.store(1, Ordering::SeqCst);
    });
    let (bytes, outcome, received) = fetched(&script, FIRST_BYTES, third);
    outcome.unwrap();
    assert_eq!(bytes, file[..end as usize]);
    assert!(received < end + (1 << 20) && script.asked().len() == 1);
    while hung_up.load(Ordering::SeqCst) == 0 {
        std::thread::sleep(Duration::from_millis(5));
    }
    assert!(sent.load(Ordering::SeqCst) < 64 << 20, "no more than systems hold for a connection");
}

#[test]
fn endless_bytes() {
    let (file, _) = coded(1);
    let served = file.clone();
    let script = Script::play(move |_, _, stream| {
        stream.write_all(b"HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n").unwrap();
        write!(stream, "{:x}\r\n", served.len()).unwrap();
        stream.write_all(&served).unwrap();
        while stream.write_all(b"\r\n400\r\n").and_then(|()| stream.write_all(&[1; 1024])).is_ok() {}
    });
    let (bytes, outcome, received) = fetched(&script, u64::MAX, whole_file);
    let error = outcome.unwrap_err().to_string();
    assert!(
        error.starts_with(&format!("byte {}: ", file.len())) && error.contains("behind the last atom"),
        "{error}"
    );
    assert!(bytes == file && received < file.len() as u64 + (1 << 20));
    let noise = Script::play(|_, _, stream| {
        let _ = stream.write_all(b"HTTP/1.1 200 OK\r\n\r\n");
        while stream.write_all(&[0; 1024]).is_ok() {}
    });
    let error = fetched(&noise, u64::MAX, whole_file).1.unwrap_err();
    assert_eq!(error.to_string(), "byte 0: not a .uwm file (spec §3.2)");
}

#[test]
fn connections_that_break_in_mid_body() {
    let (file, _) = coded(1);
    let served = file.clone();
    let script = Script::answers(move |_, asked| {
        let mut answer = asked.answer(&served, TAG);
        answer.truncate(head_length(&answer) + 3000);
        answer
    });
    let (bytes, outcome, received) = fetched(&script, u64::MAX, whole_file);
    outcome.unwrap();
    assert!(bytes == file && received == file.len() as u64);
    let starts: Vec<_> = script.asked().iter().map(|asked| asked.range().0).collect();
    let expected: Vec<_> = (0..file.len()).step_by(3000).collect();
    assert_eq!(starts, expected, "each goes on at the byte where the one before broke");
    assert!(script.asked()[1..].iter().all(|asked| asked.header("if-range") == TAG));
}

#[test]
fn a_server_without_ranges_that_breaks_is_read_again() {
    let (file, _) = coded(1);
    let served = file.clone();
    let script = Script::answers(move |number, _| {
        let mut answer = whole(&served, TAG);
        answer.truncate(head_length(&answer) + 5000 * (number + 1));
        answer
    });
    let (bytes, outcome, received) = fetched(&script, u64::MAX, whole_file);
    outcome.unwrap();
    assert!(bytes == file && received > file.len() as u64);
}

#[test]
fn a_connection_that_always_breaks_is_given_up() {
    let script = Script::play(|_, _, _| {});
    let heard = Arc::new(Mutex::new(Vec::new()));
    let hear = heard.clone();
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    let error = runtime.block_on(async {
        let source = Http::new(&script.url(), HttpOptions { retries: 3, ..options() }).unwrap();
        let source = source.on_retry(move |retry| hear.lock().unwrap().push(retry.after));
        let mut transfer = Transfer::new(source, 100, |contents: &Contents| Ok(whole_file(contents)));
        transfer.next().await.unwrap_err()
    });
    assert!(matches!(Fault::of(&error), Some(Fault::Unavailable { tries: 4, .. })), "{error}");
    assert_eq!(*heard.lock().unwrap(), [1, 2, 4].map(Duration::from_millis));
    assert_eq!(script.asked().len(), 4);
}

#[test]
fn a_connection_that_breaks_at_the_same_byte_is_given_up() {
    let (file, contents) = coded(1);
    let cut = file.len() - 100;
    assert!(cut > contents.header.table_end() as usize + 4096, "more than makes failures forgotten");
    // Without ranges and with them: each time as far as before, and no byte further.
    for ranges in [false, true] {
        let served = file.clone();
        let script = Script::answers(move |_, asked| {
            let mut answer = if ranges { asked.answer(&served, TAG) } else { whole(&served, TAG) };
            let start = if ranges { asked.range().0 } else { 0 };
            answer.truncate(head_length(&answer) + cut.saturating_sub(start));
            answer
        });
        let options = HttpOptions { retries: 3, ..options() };
        let outcome = fetched_with(&script, options, u64::MAX, whole_file);
        assert!(matches!(fault(outcome), Fault::Unavailable { tries: 4, .. }));
        assert_eq!(script.asked().len(), 4, "once, and three times again");
    }
}

#[test]
fn a_file_that_is_cut_off_is_told_at_once() {
    let (file, _) = coded(1);
    let cut = file.len() - 100;
    let served = file[..cut].to_vec();
    // No length at all, and then nothing behind the cut.
    let script = Script::answers(move |_, asked| match asked.range().0 {
        0 => [b"HTTP/1.1 200 OK\r\nConnection: close\r\n\r\n", &served[..]].concat(),
        _ => b"HTTP/1.1 416 No\r\nContent-Length: 0\r\n\r\n".to_vec(),
    });
    let error = fetched(&script, u64::MAX, whole_file).1.unwrap_err();
    assert_eq!(
        error.to_string(),
        format!("byte {cut}: the file is cut off: 100 bytes are missing (spec §3.1)")
    );
    assert!(script.asked().len() <= 2);
}

#[test]
fn a_version_that_changes_is_told() {
    let ((one, _), (two, _)) = (coded(1), coded(2));
    type Reply = fn(&[u8], &Asked) -> Vec<u8>;
    let answers: [Reply; 3] = [
        // As it should be: If-Range fails, all of the other file comes.
        |two, asked| asked.answer(two, "\"two\""),
        // A part of the other file, though it was not to be.
        |two, asked| {
            let (first, last) = asked.range();
            let last = last.min(two.len() - 1);
            let head = format!(
                "HTTP/1.1 206 P\r\nContent-Range: bytes {first}-{last}/{}\r\nETag: \"two\"\r\n\r\n",
                two.len()
            );
            [head.as_bytes(), &two[first..=last]].concat()
        },
        |_, _| b"HTTP/1.1 412 No\r\nContent-Length: 0\r\n\r\n".to_vec(),
    ];
    for answer in answers {
        let (one, two) = (one.clone(), two.clone());
        let script = Script::answers(move |number, asked| match number {
            0 => {
                let mut answer = asked.answer(&one, TAG);
                answer.truncate(head_length(&answer) + 6000);
                answer
            }
            _ => answer(&two, asked),
        });
        assert_eq!(fault(fetched(&script, u64::MAX, whole_file)), Fault::Changed);
        assert_eq!(script.asked().len(), 2);
    }
}

#[test]
fn dates_and_lengths_tell_versions_apart_where_there_is_no_tag() {
    let (file, _) = coded(1);
    let fetch = |dates: [&'static str; 2]| {
        let served = file.clone();
        let script = Script::answers(move |number, asked| {
            let line = format!("Last-Modified: {}", dates[number.min(1)]);
            let answer = asked.answer(&served, "x");
            let text = answer.windows(7).position(|w| w == b"ETag: x").unwrap();
            [&answer[..text], line.as_bytes(), &answer[text + 7..]].concat()
        });
        let outcome = fetched(&script, 1000, whole_file);
        assert!(script.asked().iter().all(|asked| asked.header("if-range").is_empty()));
        outcome
    };
    let (one, two) = ("Sun, 06 Nov 1994 08:49:37 GMT", "Sun, 06 Nov 1994 08:49:38 GMT");
    let (bytes, outcome, _) = fetch([one, one]);
    outcome.unwrap();
    assert_eq!(bytes, file);
    assert_eq!(fault(fetch([one, two])), Fault::Changed);
}

#[test]
fn statuses_that_pass_and_statuses_that_do_not() {
    let (file, _) = coded(1);
    let first = |head: &'static str| {
        let file = file.clone();
        Script::answers(move |number, asked| match number {
            0 => format!("HTTP/1.1 {head}\r\nContent-Length: 0\r\n\r\n").into(),
            _ => asked.answer(&file, TAG),
        })
    };
    for head in [
        "503 Busy\r\nRetry-After: 0",
        "429 Many\r\nRetry-After: 1",
        "500 Oh",
        "502 Oh",
        "504 Oh",
        "408 Slow",
        "503 Busy\r\nRetry-After: Sun, 06 Nov 1994 08:49:37 GMT",
        "503 Busy\r\nRetry-After: soon",
    ] {
        let script = first(head);
        let (bytes, outcome, _) = fetched(&script, u64::MAX, whole_file);
        outcome.unwrap();
        assert!(bytes == file && script.asked().len() == 2, "{head}");
    }
    for (head, what) in [
        ("404 Not Found", "status 404 Not Found"),
        ("401 No", "status 401 Unauthorized"),
        ("410 Gone", "status 410 Gone"),
        ("204 Nothing", "status 204 No Content"),
        ("501 No", "status 501 Not Implemented"),
        ("503 Busy\r\nRetry-After: 3600", "status 503 Service Unavailable; it asks to come again in 3600 s"),
    ] {
        let script = first(head);
        assert_eq!(fault(fetched(&script, u64::MAX, whole_file)), Fault::Refused(what.to_owned()));
        assert_eq!(script.asked().len(), 1, "{head}");
    }
}

#[test]
fn answers_that_make_no_sense() {
    let (file, _) = coded(1);
    for lines in [
        "206 P\r\nContent-Length: 100",
        "206 P\r\nContent-Range: bytes 5-99/1000\r\nContent-Length: 95",
        "206 P\r\nContent-Range: bytes 0-99/50\r\nContent-Length: 100",
        "206 P\r\nContent-Range: bytes 99-0/1000\r\nContent-Length: 100",
        "206 P\r\nContent-Range: lines 0-99/1000\r\nContent-Length: 100",
        "206 P\r\nContent-Type: multipart/byteranges; boundary=x\r\nContent-Length: 100",
        "200 OK\r\nContent-Encoding: gzip\r\nContent-Length: 100",
        "416 No\r\nContent-Range: bytes */1000\r\nContent-Length: 0",
        "302 Away\r\nContent-Length: 0",
        "302 Away\r\nLocation: ftp://example.org/\r\nContent-Length: 0",
        "302 Away\r\nLocation: /again\r\nContent-Length: 0",
    ] {
        let answer = [format!("HTTP/1.1 {lines}\r\n\r\n").as_bytes(), &file[..100]].concat();
        let script = Script::answers(move |_, _| answer.clone());
        let fault = fault(fetched(&script, 100, whole_file));
        assert!(matches!(fault, Fault::Nonsense(_)), "{lines}: {fault}");
    }
}

#[test]
fn lengths_that_lie() {
    let (file, contents) = coded(1);
    // More bytes than the range that they are said to be.
    let served = file.clone();
    let script = Script::answers(move |_, asked| {
        let (first, last) = asked.range();
        let last = last.min(served.len() - 1);
        let head = format!(
            "HTTP/1.1 206 P\r\nETag: \"one\"\r\nContent-Range: bytes {first}-{last}/{}\r\n\r\n",
            served.len()
        );
        [head.as_bytes(), &served[first..=last], &[9; 500]].concat()
    });
    let (bytes, outcome, _) = fetched(&script, 100, third);
    outcome.unwrap();
    assert_eq!(bytes, file[..contents.bytes(contents.steps(3)).end as usize]);
    // A length that is shorter than the range: the rest is asked for.
    let served = file.clone();
    let script = Script::answers(move |number, asked| {
        let answer = String::from_utf8_lossy(&asked.answer(&served, TAG)).into_owned();
        let (first, last) = asked.range();
        let last = last.min(served.len() - 1);
        let length = if number == 0 { 1000 } else { last + 1 - first };
        assert!(answer.starts_with("HTTP/1.1 206"));
        let head = format!(
            "HTTP/1.1 206 P\r\nETag: \"one\"\r\nContent-Length: {length}\r\nContent-Range: bytes {first}-{last}/{}\r\n\r\n",
            served.len()
        );
        [head.as_bytes(), &served[first..first + length]].concat()
    });
    let (bytes, outcome, _) = fetched(&script, u64::MAX, whole_file);
    outcome.unwrap();
    assert_eq!(bytes, file);
    // A file that is said to be shorter, or longer, than its table of contents says: known before an atom is asked for, or never read.
    for (total, what) in
        [(file.len() - 7, "cut off: 7 bytes"), (file.len() + 7, "7 bytes behind the last atom")]
    {
        let served = [&file[..], &[0; 7]].concat();
        let script = Script::answers(move |_, asked| asked.answer(&served[..total], TAG));
        let error = fetched(&script, 300, whole_file).1.unwrap_err();
        assert!(matches!(error, Error::Format(_)) && error.to_string().contains(what), "{error}");
    }
}

#[test]
fn a_byte_that_is_wrong() {
    let (mut file, contents) = coded(1);
    let atom = contents.atoms[7];
    file[atom.offset as usize + 3] ^= 0x40;
    let served = file.clone();
    let script = Script::answers(move |_, asked| asked.answer(&served, TAG));
    let (bytes, outcome, _) = fetched(&script, u64::MAX, whole_file);
    let error = outcome.unwrap_err().to_string();
    assert!(
        error.starts_with(&format!("byte {}: atom 7 (", atom.offset)) && error.contains("checksum"),
        "{error}"
    );
    assert_eq!(bytes, file[..atom.offset as usize], "what came before it is sound");
}

#[test]
fn a_table_without_measure() {
    let (mut file, _) = coded(1);
    // 16 MiB of table, of which nothing comes.
    file[13..16].fill(0xFF);
    file.truncate(400);
    let script = Script::answers(move |_, asked| asked.answer(&file, TAG));
    let error = fetched(&script, FIRST_BYTES, whole_file).1.unwrap_err().to_string();
    assert!(error.starts_with("byte 400: the file is cut off: at least "), "{error}");
}

#[test]
fn secrets_stay_with_the_server_that_they_are_for() {
    let (file, _) = coded(1);
    let served = file.clone();
    let other = Script::answers(move |_, asked| asked.answer(&served, TAG));
    let to = other.url();
    let script = Script::answers(move |_, _| {
        format!("HTTP/1.1 307 Away\r\nLocation: {to}\r\nContent-Length: 0\r\n\r\n").into()
    });
    let mut headers = reqwest::header::HeaderMap::new();
    headers.insert("x-api-key", "secret".parse().unwrap());
    let (bytes, outcome, _) =
        fetched_with(&script, HttpOptions { headers, ..options() }, u64::MAX, whole_file);
    outcome.unwrap();
    assert_eq!(bytes, file);
    assert_eq!(script.asked()[0].header("x-api-key"), "secret");
    assert!(!other.asked()[0].headers.contains_key("x-api-key"));
}

#[test]
fn dropping_hangs_up() {
    let (file, _) = coded(1);
    let (told, hung_up) = std::sync::mpsc::channel();
    let told = Mutex::new(told);
    let script = Script::play(move |_, asked, stream| {
        let answer = asked.answer(&file, TAG);
        stream.write_all(&answer[..head_length(&answer) + 4000]).unwrap();
        // The rest never comes; the client goes.
        let count = stream.read(&mut [0; 16]).unwrap_or(0);
        told.lock().unwrap().send(count).unwrap();
    });
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    runtime.block_on(async {
        let source = Http::new(&script.url(), options()).unwrap();
        let mut transfer = Transfer::new(source, u64::MAX, |contents: &Contents| Ok(whole_file(contents)));
        assert!(matches!(transfer.next().await.unwrap(), Some(Piece::Head { .. })));
        let task = tokio::spawn(async move { while transfer.next().await.unwrap().is_some() {} });
        tokio::task::yield_now().await;
        task.abort();
        assert!(task.await.unwrap_err().is_cancelled());
    });
    drop(runtime);
    assert_eq!(hung_up.recv().unwrap(), 0);
}

#[test]
fn silence() {
    let (file, _) = coded(1);
    for bytes in [0, 1000] {
        let served = file.clone();
        let script = Script::play(move |_, asked, stream| {
            let answer = asked.answer(&served, TAG);
            let _ = stream.write_all(&answer[..bytes]);
            // Until the client goes.
            let _ = stream.read(&mut [0; 16]);
        });
        let impatient = HttpOptions { timeout: Duration::from_millis(100), retries: 1, ..options() };
        let fault = fault(fetched_with(&script, impatient, u64::MAX, whole_file));
        assert_eq!(fault.to_string(), "nothing came in time (given up after 2 tries)");
    }
}
