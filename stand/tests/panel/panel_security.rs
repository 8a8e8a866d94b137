//! The panel's gate, walked on raw sockets: foreign, missing, double and malformed senders and addressees, tokens, names of files, bodies,
//! slow and random clients.
#![cfg(unix)]
#![allow(clippy::unwrap_used)]

use crate::common;
use crate::common::panel;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::time::{Duration, Instant};

use common::folder;
use panel::Panel;
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};

/// Values of a header that are not the server's own; each entry is the lines of the header.
fn foreign(name: &str, prefix: &str, port: u16) -> Vec<String> {
    let line = |value: &str| format!("{name}: {value}\r\n");
    let mut all = vec![String::new()];
    let other = port ^ 1;
    for host in [
        format!("evil.example:{port}"),
        format!("127.0.0.1:{other}"),
        "127.0.0.1".to_owned(),
        format!("localhost.evil:{port}"),
        format!("127.0.0.1.evil:{port}"),
        format!("127.0.0.1:{port}.evil"),
        format!("127.0.0.1:{port}@evil.example"),
        format!("[::1]:{port}"),
        format!("0.0.0.0:{port}"),
        format!("127.1:{port}"),
        format!("2130706433:{port}"),
        format!("LOCALHOST:{port}x"),
        format!("127.0.0.1:0{port}"),
    ] {
        all.push(line(&format!("{prefix}{host}")));
    }
    let own = line(&format!("{prefix}127.0.0.1:{port}"));
    all.extend([line(""), line("null"), line("\u{7f}\u{80}"), own.repeat(2), own.clone() + &line(&format!("{prefix}evil.example:{port}"))]);
    all
}

#[test]
fn foreign_hosts_and_origins_are_refused_for_every_method_and_no_byte_reaches_the_stand() {
    let folder = folder();
    let panel = Panel::new(folder.path(), &[]);
    let host = format!("Host: 127.0.0.1:{}\r\n", panel.port);
    let origin = format!("Origin: http://127.0.0.1:{}\r\n", panel.port);
    let key = format!("Authorization: Bearer {}\r\n", panel.token);
    let upgrade =
        "Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n";
    let kinds = [
        ("GET /api/session", "", ""),
        ("POST /api/stop", "Content-Length: 2\r\n", "{}"),
        ("GET /socket", upgrade, ""),
        ("POST /api/upload?name=foreign.csv", "Content-Length: 10\r\n", "t_s,x\n0,1\n"),
        ("POST /api/inspect", "Content-Length: 2\r\n", "{}"),
        ("POST /api/export", "Content-Length: 2\r\n", "{}"),
        ("GET /", "", ""),
        ("OPTIONS /api/stop", "", ""),
        ("PUT /api/stop", "Content-Length: 0\r\n", ""),
    ];
    let mut page = panel.page();
    let mut walked = 0;
    for (request, more, body) in kinds {
        let changes = !request.starts_with("GET") || !more.is_empty();
        let heads = foreign("Host", "", panel.port).into_iter().map(|host| (host, origin.clone())).chain(
            foreign("Origin", "http://", panel.port)
                .into_iter()
                .filter(|lines| changes || !lines.is_empty())
                .map(|origin| (host.clone(), origin)),
        );
        for (host, origin) in heads {
            let head = format!("{request} HTTP/1.1\r\n{host}{origin}{key}{more}\r\n{body}");
            let status = panel.raw(head.as_bytes());
            assert!((400..500).contains(&status), "{status}: {head}");
            walked += 1;
        }
    }
    assert!(walked > 250, "{walked}");
    assert!(!folder.path().join("panel/foreign.csv").exists(), "no file is written");
    // The same requests with the right headers are answered, so the refusals have the tested reason.
    assert_eq!(panel.raw(format!("GET /socket HTTP/1.1\r\n{host}{origin}{upgrade}\r\n").as_bytes()), 101);
    assert_eq!(panel.raw(format!("GET /api/session HTTP/1.1\r\n{host}{key}\r\n").as_bytes()), 200);
    assert_eq!(panel.raw(format!("GET / HTTP/1.1\r\n{}\r\n", host.replace("127.0.0.1", "localhost")).as_bytes()), 200);
    // A stop would have latched a fault.
    page.until(|page| page.state["drive"]["mode"] != "", false);
    assert_eq!(page.state["drive"]["fault"], "");
    assert_eq!(panel.raw(format!("POST /api/stop HTTP/1.1\r\n{host}{origin}{key}Content-Length: 2\r\n\r\n{{}}").as_bytes()), 200);
    page.until(|page| page.state["drive"]["fault"] != "", false);
}

#[test]
fn requests_of_other_sites_and_absolute_addresses_are_refused() {
    let folder = folder();
    let panel = Panel::new(folder.path(), &[]);
    let own = format!("Host: 127.0.0.1:{}\r\nAuthorization: Bearer {}\r\n", panel.port, panel.token);
    for site in ["cross-site", "same-site", "none, same-origin"] {
        assert_eq!(panel.raw(format!("GET /api/session HTTP/1.1\r\n{own}Sec-Fetch-Site: {site}\r\n\r\n").as_bytes()), 403, "{site}");
    }
    assert_eq!(panel.raw(format!("GET /api/session HTTP/1.1\r\n{own}Sec-Fetch-Site: same-origin\r\n\r\n").as_bytes()), 200);
    assert_eq!(panel.raw(format!("GET http://evil.example/api/session HTTP/1.1\r\n{own}\r\n").as_bytes()), 421);
}

#[test]
fn token_is_required_for_data_and_compared_as_a_whole() {
    let folder = folder();
    let panel = Panel::new(folder.path(), &[]);
    let host = format!("Host: 127.0.0.1:{}\r\n", panel.port);
    let status = |lines: &str| panel.raw(format!("GET /api/session HTTP/1.1\r\n{host}{lines}\r\n").as_bytes());
    let right = format!("Authorization: Bearer {}\r\n", panel.token);
    assert_eq!(panel.token.len(), 64, "256 bits");
    assert_eq!(status(&right), 200);
    for path in ["upload?name=a.csv", "inspect", "export"] {
        let lines = format!("Origin: http://127.0.0.1:{}\r\nContent-Length: 2\r\n\r\n{{}}", panel.port);
        assert_eq!(panel.raw(format!("POST /api/{path} HTTP/1.1\r\n{host}{lines}").as_bytes()), 401, "{path}");
    }
    let half = format!("Authorization: Bearer {}\r\n", &panel.token[..32]);
    for wrong in [
        "",
        "Authorization: Bearer \r\n",
        "Authorization: Bearer 0\r\n",
        &half,
        &right.replace("Bearer", "Basic"),
        &right.repeat(2).replacen("Bearer", "bearer", 1),
    ] {
        let status = status(wrong);
        assert!((400..500).contains(&status), "{wrong:?}: {status}");
    }
    assert_eq!(panel.raw(format!("GET /api/session?token={} HTTP/1.1\r\n{host}\r\n", panel.token).as_bytes()), 401, "not in the query");
    let other = Panel::new(folder.path(), &["--folder", "other"]);
    assert_ne!(panel.token, other.token, "of this run");
}

#[test]
fn every_route_of_the_source_needs_the_token() {
    let folder = folder();
    let panel = Panel::new(folder.path(), &[]);
    let host = format!("127.0.0.1:{}", panel.port);
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../stand-panel/src");
    let files = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).filter(|path| !path.ends_with("server.rs"));
    let source: String = files.map(|path| std::fs::read_to_string(path).unwrap()).collect();
    let routes: Vec<(&str, bool)> = source
        .split(".route(\"/")
        .skip(1)
        .filter_map(|rest| rest.lines().next()?.split_once("\", "))
        .flat_map(|(path, methods)| {
            [("get(", false), ("post(", true)].into_iter().filter(|(name, _)| methods.contains(name)).map(move |(_, posts)| (path, posts))
        })
        .collect();
    assert!(routes.len() >= 20, "{routes:?}");
    for (path, posts) in routes {
        let request = |key: &str| {
            let (method, body) = if posts { ("POST", "{}") } else { ("GET", "") };
            let head =
                format!("{method} /api/{path}?name=model.toml&kind=drive HTTP/1.1\r\nHost: {host}\r\nOrigin: http://{host}\r\n{key}");
            panel.raw(format!("{head}Content-Length: {}\r\n\r\n{body}", body.len()).as_bytes())
        };
        assert_eq!(request(""), 401, "{path}");
        assert_ne!(request(&format!("Authorization: Bearer {}\r\n", panel.token)), 401, "{path}");
    }
}

#[test]
fn socket_without_a_token_is_closed_after_two_seconds_and_reads_nothing() {
    let folder = folder();
    let panel = Panel::new(folder.path(), &[]);
    let own = format!("Host: 127.0.0.1:{}\r\nOrigin: http://127.0.0.1:{}\r\n", panel.port, panel.port);
    let mut stream = TcpStream::connect(("127.0.0.1", panel.port)).unwrap();
    let upgrade =
        "Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n";
    stream.write_all(format!("GET /socket HTTP/1.1\r\n{own}{upgrade}\r\n").as_bytes()).unwrap();
    let begun = Instant::now();
    let mut all = Vec::new();
    stream.read_to_end(&mut all).unwrap();
    let text = String::from_utf8_lossy(&all).to_lowercase();
    let after = text.split_once("\r\n\r\n").unwrap().1.len();
    assert!(text.starts_with("http/1.1 101") && after <= 4 && begun.elapsed() < Duration::from_secs(4), "{text} {:?}", begun.elapsed());
}

#[test]
fn every_response_has_the_policy_and_none_allows_another_origin() {
    let folder = folder();
    let panel = Panel::new(folder.path(), &[]);
    for path in ["/", "/main.js", "/api/session", "/absent"] {
        let mut stream = TcpStream::connect(("127.0.0.1", panel.port)).unwrap();
        write!(stream, "GET {path} HTTP/1.1\r\nHost: 127.0.0.1:{}\r\nConnection: close\r\n\r\n", panel.port).unwrap();
        let mut head = String::new();
        stream.read_to_string(&mut head).unwrap();
        let head = head.split_once("\r\n\r\n").unwrap().0.to_lowercase();
        for needed in ["default-src 'none'", "frame-ancestors 'none'", "x-content-type-options: nosniff", "referrer-policy: no-referrer"] {
            assert!(head.contains(needed), "{path}: {head}");
        }
        assert!(!head.contains("access-control") && !head.contains("set-cookie") && !head.contains("unsafe"), "{path}: {head}");
    }
}

#[test]
fn names_lead_nowhere_else_and_bad_requests_get_one_line() {
    let folder = folder();
    std::fs::write(folder.path().join("secret.csv"), "t_s,u_V\n0,1\n").unwrap();
    let panel = Panel::new(folder.path(), &[]);
    std::os::unix::fs::symlink(folder.path().join("secret.csv"), folder.path().join("panel/link.csv")).unwrap();
    for name in [
        "../secret.csv",
        "..%2fsecret.csv",
        "%2e%2e%2fsecret.csv",
        "/etc/passwd",
        "%2Fetc%2Fpasswd",
        "link.csv",
        "a%00b",
        "%3Cimg%20src=x%3E.csv",
        ".",
        "",
    ] {
        for path in ["log", "answer", "model", "effect", "columns", "pictures", "steps", "work", "lab-answers", "lab-report"] {
            let (status, answer) = panel.request("GET", &format!("{path}?name={name}"), "");
            assert!((400..500).contains(&status), "{path} {name}: {status}");
            assert!(answer["error"].as_str().is_none_or(|error| error.lines().count() == 1), "{answer}");
        }
    }
    let bodies = [
        ("inspect", r#"{"name":"../secret.csv"}"#),
        ("inspect", r#"{"name":"link.csv","accept":true}"#),
        ("inspect", r#"{"name":"absent.csv"}"#),
        ("inspect", r#"{"name":"model.toml"}"#),
        ("inspect", r#"{"name":"model.toml","units":[["t","ms\nreboot"]]}"#),
        ("inspect", r#"{"name":"model.toml","file":"x"}"#),
        ("lab-answers", r#"{"name":"..","sha256":"","answers":{}}"#),
        ("lab-check", r#"{"name":"../panel","language":"en"}"#),
        ("export", "[[[["),
        ("export", ""),
        ("command", r#"{"client":1,"line":"OUTPut ON\nOUTPut ON"}"#),
        ("command", r#"{"client":1,"line":"HOST:UNATTended 1000"}"#),
        ("command", r#"{"client":1,"line":"*IDN?;host:arm 0"}"#),
        ("command", r#"{"client":1,"line":"HOST:ARM?;ARM 3600"}"#),
        ("command", r#"{"client":1,"line":"host:unatt?;unattended 900000"}"#),
        ("command", r#"{"client":1}"#),
        ("command", "[[[["),
        ("record", r#"{"client":1,"profile":"x","mode":"rate","seconds":1}"#),
        ("record", r#"{"client":1,"profile":"multi-step","mode":"rate","seconds":1e300}"#),
        ("record", r#"{"client":1,"profile":"multi-step","mode":"rate","seconds":5}"#),
        ("record", r#"{"client":1,"profile":"constant","mode":"voltage","amplitude":0,"seconds":5,"unattended":true}"#),
        ("compensate", r#"{"client":1,"model":"model.toml","log":null}"#),
        ("compensate", r#"{"client":1,"model":"../model.toml","log":null}"#),
        ("allan", r#"{"log":"../secret.csv","column":"u_V"}"#),
        ("allan", r#"{"log":"link.csv","column":"u_V"}"#),
        ("drift", r#"{"client":1,"place":"moon"}"#),
        ("calibrate", r#"{"client":1,"place":"simulated","kind":"drive","serial":"a\nb"}"#),
        ("calibrate", r#"{"client":1,"place":"stand","kind":"drive"}"#),
        ("reply", r#"{"text":1}"#),
        ("model", r#"{"name":"model.toml","add":"no-effect"}"#),
        ("model", r#"{"name":"../../x.toml","add":"coulomb"}"#),
        ("model", r#"{"name":"model.toml","add_expression":{"name":"x","torque_N_m":"import os"}}"#),
    ];
    for (path, body) in bodies {
        let (status, answer) = panel.request("POST", path, body);
        assert!((400..500).contains(&status) && answer["error"].as_str().unwrap().lines().count() == 1, "{path} {body}: {status} {answer}");
    }
    let deep = format!(r#"{{"name":"model.toml","add_expression":{{"name":"x","torque_N_m":"{}"}}}}"#, "(".repeat(900));
    assert_eq!(panel.request("POST", "model", &deep).0, 422);
    assert_eq!(panel.request("POST", "model", &" ".repeat((1 << 20) + 1)).0, 413);
    assert_eq!(panel.request("GET", "session", "").0, 200, "alive");
}

/// Names of the session's folder, with the hidden ones.
fn names(session: &std::path::Path) -> Vec<String> {
    let mut names: Vec<String> = std::fs::read_dir(session).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn uploads_are_declared_and_bounded_and_replace_no_file() {
    let folder = folder();
    let panel = Panel::new(folder.path(), &[]);
    let session = folder.path().join("panel");
    let before = names(&session);
    let host = panel.host();
    let own = format!("Host: {host}\r\nOrigin: http://{host}\r\nAuthorization: Bearer {}\r\n", panel.token);
    let head = |path: &str, more: &str| format!("POST /api/{path} HTTP/1.1\r\n{own}{more}\r\n\r\n");
    assert_eq!(panel.raw(format!("{}1\r\nx\r\n0\r\n\r\n", head("upload?name=a.csv", "Transfer-Encoding: chunked")).as_bytes()), 411);
    assert_eq!(panel.raw(head("upload?name=a.csv", &format!("Content-Length: {}", (512_u64 << 20) + 1)).as_bytes()), 413);
    assert_eq!(panel.request_bytes("POST", "export", &vec![b' '; (64 << 20) + 1]).0, 413);
    // One that breaks off leaves nothing.
    let mut broken = TcpStream::connect(("127.0.0.1", panel.port)).unwrap();
    broken.write_all(format!("{}t_s,u_V\n0,1\n", head("upload?name=a.csv", "Content-Length: 1000")).as_bytes()).unwrap();
    std::thread::sleep(Duration::from_millis(300));
    drop(broken);
    let until = Instant::now() + Duration::from_secs(10);
    while names(&session) != before && Instant::now() < until {
        std::thread::sleep(Duration::from_millis(50));
    }
    assert_eq!(names(&session), before);
    // Names that lead elsewhere, that are no log, or that exist.
    std::os::unix::fs::symlink(folder.path().join("new.csv"), session.join("dangling.csv")).unwrap();
    std::fs::write(session.join("orphan.import.toml"), "").unwrap();
    for name in [
        "..%2Fa.csv",
        "%2Ftmp%2Fa.csv",
        "dangling.csv",
        "a.toml",
        "a.import.toml",
        "a.html",
        "a",
        ".csv",
        "",
        "a%00.csv",
        "%3Cimg%3E.csv",
        "a%0A.csv",
    ] {
        let (status, answer) = panel.request("POST", &format!("upload?name={name}"), "t_s,u_V\n0,1\n");
        assert!((400..500).contains(&status) && answer["error"].as_str().unwrap().lines().count() == 1, "{name}: {status} {answer}");
    }
    for name in ["commands.txt", "orphan.csv"] {
        assert_eq!(panel.request("POST", &format!("upload?name={name}"), "t_s,u_V\n0,1\n").0, 409, "{name}");
    }
    assert!(!folder.path().join("a.csv").exists() && !folder.path().join("new.csv").exists());
    let text = "t_s,u_V\n0,1\n0.1,2\n";
    assert_eq!(panel.request("POST", "upload?name=a.csv", text).0, 200);
    assert_eq!(panel.request("POST", "upload?name=a.csv", "other").0, 409);
    assert_eq!(std::fs::read_to_string(session.join("a.csv")).unwrap(), text);
    // A file that is no log is data: what is wrong with it is one line.
    assert_eq!(panel.request_bytes("POST", "upload?name=b.parquet", &[0xFF; 3_000_000]).0, 200);
    let (status, answer) = panel.request("POST", "inspect", r#"{"name":"b.parquet"}"#);
    assert!(status == 422 && answer["error"].as_str().unwrap().lines().count() == 1, "{status} {answer}");
    assert_eq!(panel.request("GET", "session", "").0, 200, "alive");
}

#[test]
fn slow_and_random_clients_leave_the_server_alive() {
    let folder = folder();
    let panel = Panel::new(folder.path(), &[]);
    let mut slow: Vec<TcpStream> = (0..60).map(|_| TcpStream::connect(("127.0.0.1", panel.port)).unwrap()).collect();
    for stream in &mut slow {
        stream.write_all(b"GET / HTTP/1.1\r\nHost: ").unwrap();
    }
    assert_eq!(panel.request("GET", "session", "").0, 200, "while 60 heads are open");
    let mut random = Xoshiro256PlusPlus::seed_from_u64(21);
    let words = [
        "GET ",
        "POST ",
        "/api/stop",
        "/socket",
        "/",
        " HTTP/1.1",
        "\r\n",
        "\r\n\r\n",
        "Host: ",
        "127.0.0.1",
        "Origin: ",
        "null",
        "Content-Length: ",
        "99999999999",
        "-1",
        "Transfer-Encoding: chunked",
        "\0",
        "\u{fe}",
        "Upgrade: websocket",
    ];
    for _ in 0..1000 {
        let mut stream = TcpStream::connect(("127.0.0.1", panel.port)).unwrap();
        let bytes: String = (0..random.next_u64() % 20).map(|_| words[(random.next_u64() % words.len() as u64) as usize]).collect();
        let _ = stream.write_all(bytes.as_bytes());
    }
    let begun = Instant::now();
    for stream in &mut slow {
        stream.set_read_timeout(Some(Duration::from_secs(10))).unwrap();
        let mut rest = Vec::new();
        let _ = stream.read_to_end(&mut rest);
    }
    assert!(begun.elapsed() < Duration::from_secs(9), "slow heads are closed after five seconds: {:?}", begun.elapsed());
    assert_eq!(panel.request("GET", "session", "").0, 200);
}

/// Reads the status and the length of the body of each response until the connection ends.
fn statuses(stream: TcpStream) -> Vec<u16> {
    let mut reader = BufReader::new(stream);
    let mut all = Vec::new();
    loop {
        let (mut length, mut status, mut line) = (0, 0, String::new());
        while reader.read_line(&mut line).is_ok_and(|count| count > 2) {
            let text = line.to_lowercase();
            if let Some(rest) = text.strip_prefix("http/1.1 ") {
                status = rest[..3].parse().unwrap();
            }
            if let Some(rest) = text.strip_prefix("content-length: ") {
                length = rest.trim().parse().unwrap();
            }
            line.clear();
        }
        if status == 0 || reader.read_exact(&mut vec![0; length]).is_err() {
            return all;
        }
        all.push(status);
    }
}

#[test]
fn hundred_thousand_random_requests_are_answered_and_none_without_the_token_gets_data() {
    let folder = folder();
    let panel = Panel::new(folder.path(), &[]);
    let mut random = Xoshiro256PlusPlus::seed_from_u64(2126);
    let own = format!("127.0.0.1:{}", panel.port);
    let hosts = [own.clone(), own.clone(), own.clone(), format!("evil.example:{}", panel.port)];
    let origins = [format!("http://{own}"), format!("http://{own}"), "null".to_owned(), "http://evil.example".to_owned()];
    let keys = ["", "Authorization: Bearer 00\r\n", "Authorization: Basic x\r\n", "X-Key: 1\r\n"];
    let methods = ["GET", "POST", "PUT", "DELETE", "PATCH", "OPTIONS"];
    let paths = [
        "session",
        "stop",
        "command",
        "record",
        "log?name=x",
        "answer?name=%00",
        "model",
        "effect?name=..%2f",
        "..",
        "%ff",
        "compensate",
        "drift",
    ];
    let bodies = ["", "{}", "[[[[", "{\"client\":1,\"line\":\"OUTPut ON\"}", "\u{0}\u{7f}"];
    let (mut answered, mut refused) = (0, 0);
    for _ in 0..500 {
        let mut stream = TcpStream::connect(("127.0.0.1", panel.port)).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
        let reading = std::thread::spawn({
            let stream = stream.try_clone().unwrap();
            move || statuses(stream)
        });
        for k in 0..200 {
            let mut one = |of: usize| (random.next_u64() % of as u64) as usize;
            let body = bodies[one(bodies.len())];
            let (method, path, host, origin, key) =
                (methods[one(6)], paths[one(paths.len())], &hosts[one(4)], &origins[one(4)], keys[one(4)]);
            let last = if k == 199 { "Connection: close\r\n" } else { "" };
            let request = format!(
                "{method} /api/{path} HTTP/1.1\r\nHost: {host}\r\nOrigin: {origin}\r\n{key}{last}Content-Length: {}\r\n\r\n{body}",
                body.len()
            );
            stream.write_all(request.as_bytes()).unwrap();
        }
        let statuses = reading.join().unwrap();
        answered += statuses.len();
        refused += statuses.iter().filter(|status| (400..500).contains(*status)).count();
    }
    assert_eq!((answered, refused), (100_000, 100_000));
    let mut page = panel.page();
    page.until(|page| page.state["drive"]["mode"] != "", false);
    assert_eq!(
        (&page.state["drive"]["fault"], &page.state["drive"]["is_on"]),
        (&"".into(), &false.into()),
        "the stand has noticed nothing"
    );
}
