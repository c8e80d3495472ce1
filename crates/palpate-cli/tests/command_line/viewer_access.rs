//! Access to `palpate serve`: tokens, certificates, and where its recordings are kept.

use crate::realtime;
use crate::workplace::Workplace;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::{Child, ChildStderr, Command, Stdio};

/// `palpate serve` with its address, killed when dropped.
struct Serving {
    child: Child,
    /// Lines up to the address.
    said: Vec<String>,
    /// Address with its query.
    url: String,
    _lines: std::io::Lines<BufReader<ChildStderr>>,
}

impl Serving {
    fn new(workplace: &Workplace, arguments: &[&str], token: Option<&str>) -> Self {
        let mut command = Command::new(env!("CARGO_BIN_EXE_palpate"));
        command.args(["serve", "--no-browser"]).args(arguments).current_dir(workplace.path("."));
        token.map(|token| command.env("PALPATE_TOKEN", token));
        let mut child = command.stderr(Stdio::piped()).spawn().expect("the command starts");
        let mut lines = BufReader::new(child.stderr.take().expect("standard error")).lines();
        let mut said = Vec::new();
        let url = lines.by_ref().map_while(Result::ok).find_map(|line| {
            let url = line.strip_prefix("open ").and_then(|line| line.split(' ').next().map(String::from));
            if url.is_none() {
                said.push(line);
            }
            url
        });
        let url = url.unwrap_or_else(|| panic!("no address: {said:?}"));
        Self { child, said, url, _lines: lines }
    }

    /// `127.0.0.1:PORT`, also of a server for all addresses.
    fn address(&self) -> String {
        let port = self.url.split(['/', ':']).nth(4).expect("a port");
        format!("127.0.0.1:{port}")
    }

    fn query(&self) -> &str {
        self.url.split_once('?').map_or("", |(_, query)| query)
    }

    fn status(&self, path: &str) -> String {
        let mut stream = TcpStream::connect(self.address()).expect("it listens");
        write!(stream, "GET {path} HTTP/1.1\r\nHost: {}\r\nConnection: close\r\n\r\n", self.address())
            .expect("it reads");
        let mut answer = Vec::new();
        stream.read_to_end(&mut answer).expect("an answer");
        String::from_utf8_lossy(&answer).split(' ').nth(1).unwrap_or_default().to_string()
    }
}

impl Drop for Serving {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

const CLEAR: &str = "warning: the connection is not encrypted: who is on the way to this machine can read the token, and act with \
                     it; give a certificate (--tls-cert, --tls-key), or listen on 127.0.0.1 behind an SSH tunnel";

const SURFACE: &str = "/scene/1/object/0/surface";

#[test]
fn a_token_comes_from_a_file_or_the_environment_and_its_address_works() {
    let workplace = realtime::workplace();
    let token = "a&b#c d%20+é, long";
    workplace.write("token.txt", format!("{token}\n"));
    let listen = ["fingers.toml", "--listen", "127.0.0.1:0"];
    #[cfg(unix)]
    let warning = {
        use std::os::unix::fs::PermissionsExt;
        let mode = std::fs::Permissions::from_mode(0o644);
        std::fs::set_permissions(workplace.path("token.txt"), mode).expect("permissions");
        "warning: others can read token.txt, and the token in it: chmod 600 token.txt"
    };
    let sources: [(&[&str], Option<&str>, &str); 3] = [
        (&["--token-file", "token.txt"], None, warning),
        (&[], Some(token), ""),
        (
            &["--token", token],
            None,
            "warning: everybody on this machine can read --token (ps): use --token-file, or PALPATE_TOKEN",
        ),
    ];
    for (arguments, variable, warning) in sources {
        let serving = Serving::new(&workplace, &[&listen[..], arguments].concat(), variable);
        assert_eq!(serving.query(), "token=a%26b%23c+d%2520%2B%C3%A9%2C+long");
        assert_eq!(serving.status(&format!("{SURFACE}?{}", serving.query())), "200");
        assert_eq!(serving.status(SURFACE), "403");
        let warnings: Vec<&String> =
            serving.said.iter().filter(|line| line.contains("token") || line.contains("encrypted")).collect();
        assert_eq!(warnings.first().map_or("", |line| line.as_str()), warning);
        assert!(warnings.len() <= 1, "{warnings:?}");
        if cfg!(target_os = "linux") && !arguments.contains(&token) {
            let line = std::fs::read(format!("/proc/{}/cmdline", serving.child.id())).expect("it runs");
            assert!(!String::from_utf8_lossy(&line).contains("long"), "ps shows the token");
        }
    }
    let short = "the token has 8 characters, expected 16 or more: random hexadecimal digits have 4 bits each, and 64 bits can't be \
                 guessed; `openssl rand -hex 16` makes a good one";
    workplace.write("short.txt", "hunter22\n");
    for (arguments, source) in
        [(["--token", "hunter22"], "--token"), (["--token-file", "short.txt"], "short.txt")]
    {
        let error = workplace.fail(&[&["serve"], &listen[..], &arguments].concat());
        assert_eq!(error, format!("{source}: {short}"));
    }
    let error = workplace.fail(&[&["serve"], &listen[..], &["--token-file", "none.txt"]].concat());
    assert_eq!(error, "cannot read the token none.txt: No such file or directory (os error 2)");
}

#[test]
fn beyond_this_machine_a_token_of_128_bits_is_made_and_goes_in_clear_only_with_a_warning() {
    let workplace = realtime::workplace();
    let serving = Serving::new(&workplace, &["fingers.toml", "--listen", "0.0.0.0:0"], None);
    let token = serving.query().strip_prefix("token=").expect("a token");
    assert!(token.len() == 32 && token.bytes().all(|digit| digit.is_ascii_hexdigit()), "{token}");
    assert!(serving.said.iter().any(|line| line == CLEAR), "{:?}", serving.said);
    assert_eq!((serving.status(SURFACE).as_str(), serving.status("/").as_str()), ("403", "200"));
    assert_eq!(serving.status(&format!("{SURFACE}?token={token}")), "200");
}

#[test]
fn with_a_certificate_the_address_is_https_and_nothing_warns() {
    let workplace = realtime::workplace();
    let made = Command::new("openssl")
        .args([
            "req",
            "-x509",
            "-newkey",
            "ec",
            "-pkeyopt",
            "ec_paramgen_curve:P-256",
            "-nodes",
            "-subj",
            "/CN=localhost",
        ])
        .args(["-keyout", "key.pem", "-out", "cert.pem", "-days", "2"])
        .current_dir(workplace.path("."))
        .output();
    if !made.is_ok_and(|made| made.status.success()) {
        eprintln!(
            "no openssl: no certificate is made here; palpate-viewer/tests/server/tls.rs makes its own"
        );
        return;
    }
    let tls = ["--tls-cert", "cert.pem", "--tls-key", "key.pem"];
    let serving =
        Serving::new(&workplace, &[&["fingers.toml", "--listen", "0.0.0.0:0"], &tls[..]].concat(), None);
    assert!(serving.url.starts_with("https://0.0.0.0:"), "{}", serving.url);
    assert!(!serving.said.iter().any(|line| line.contains("not encrypted")), "{:?}", serving.said);
    let error = workplace.fail(&["serve", "fingers.toml", "--tls-cert", "key.pem", "--tls-key", "key.pem"]);
    assert_eq!(
        error,
        "key.pem has no certificate: expected a PEM file with the server's, and those that sign it"
    );
}

#[test]
fn a_cache_is_found_by_a_relative_path() {
    let workplace = Workplace::new();
    let arguments = ["--scene", "shake", "--listen", "127.0.0.1:0", "--cache", "kept here"];
    for _ in 0..2 {
        let serving = Serving::new(&workplace, &arguments, None);
        assert_eq!(serving.status(SURFACE), "200");
    }
    let kept = std::fs::read_dir(workplace.path("kept here")).expect("a folder").count();
    assert!(kept > 0, "the cache is empty");
}
