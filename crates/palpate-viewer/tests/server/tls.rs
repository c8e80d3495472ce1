//! TLS by a given certificate.

use super::client::{TestServer, live_content, local, read_answer};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use palpate_viewer::{Limits, Settings, TlsIdentity};
use rcgen::{CertificateParams, KeyPair};
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;
use tokio_rustls::rustls::crypto::aws_lc_rs;
use tokio_rustls::rustls::pki_types::{CertificateDer, ServerName};
use tokio_rustls::rustls::{ClientConfig, ClientConnection, RootCertStore, StreamOwned};

/// Certificate and key of `localhost` as PEM files in a folder of a test.
struct Certificate {
    der: CertificateDer<'static>,
    certificate: PathBuf,
    key: PathBuf,
}

fn pem(kind: &str, der: &[u8]) -> String {
    format!("-----BEGIN {kind}-----\n{}\n-----END {kind}-----\n", STANDARD.encode(der))
}

impl Certificate {
    fn new(folder: &Path) -> Self {
        let pair = KeyPair::generate().expect("a key");
        let parameters = CertificateParams::new(vec!["localhost".to_string()]).expect("a name");
        let der = parameters.self_signed(&pair).expect("a certificate").der().clone();
        let (certificate, key) = (folder.join("cert.pem"), folder.join("key.pem"));
        std::fs::write(&certificate, pem("CERTIFICATE", &der)).expect("a writable folder");
        std::fs::write(&key, pem("PRIVATE KEY", &pair.serialize_der())).expect("a writable folder");
        Self { der, certificate, key }
    }
}

#[test]
fn a_page_is_served_encrypted_and_plain_requests_get_nothing() {
    let folder = tempfile::TempDir::new().expect("a temporary folder");
    let files = Certificate::new(folder.path());
    let tls = TlsIdentity::read(&files.certificate, &files.key).expect("an identity");
    let limits = Limits { header_time: Duration::from_secs(1), ..Limits::default() };
    let served = TestServer::bind(&Settings { tls: Some(tls), limits, ..local() }, live_content().0);
    let mut roots = RootCertStore::empty();
    roots.add(files.der).expect("a root");
    let config = ClientConfig::builder_with_provider(Arc::new(aws_lc_rs::default_provider()))
        .with_safe_default_protocol_versions()
        .expect("versions")
        .with_root_certificates(roots)
        .with_no_client_auth();
    let name = ServerName::try_from("localhost").expect("a name");
    let client = ClientConnection::new(Arc::new(config), name).expect("a client");
    // A client that does not shake hands does not keep its place.
    let mut silent = served.connect();
    let mut stream = StreamOwned::new(client, served.connect());
    write!(stream, "GET /session HTTP/1.1\r\nHost: localhost\r\nOrigin: https://localhost\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n\
                    Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: MDEyMzQ1Njc4OWFiY2RlZg==\r\n\r\n").expect("it reads");
    let mut answer = [0; 12];
    stream.read_exact(&mut answer).expect("an answer");
    assert_eq!(&answer, b"HTTP/1.1 101");
    let (status, ..) = served.answer("GET /", b"");
    assert_eq!(status, 0, "not encrypted");
    assert_eq!(read_answer(&mut silent).0, 0);
}

#[test]
fn files_that_are_no_identity_are_named() {
    let folder = tempfile::TempDir::new().expect("a temporary folder");
    let (one, two) = (folder.path().join("one"), folder.path().join("two"));
    for folder in [&one, &two] {
        std::fs::create_dir(folder).expect("a writable folder");
    }
    let (one, two) = (Certificate::new(&one), Certificate::new(&two));
    let read = |certificate: &Path, key: &Path| {
        let text = TlsIdentity::read(certificate, key).expect_err("no identity").to_string();
        text.replace(&format!("{}/", folder.path().display()), "")
    };
    assert_eq!(
        read(&one.key, &one.key),
        "one/key.pem has no certificate: expected a PEM file with the server's, and those that sign it"
    );
    assert_eq!(
        read(&one.certificate, &one.certificate),
        "cannot read one/cert.pem: no items found; expected a PEM file"
    );
    assert_eq!(
        read(&one.certificate, &two.key),
        "cannot serve with the certificate one/cert.pem and the key two/key.pem: keys may not be consistent: KeyMismatch"
    );
    let missing = read(&folder.path().join("none.pem"), &one.key);
    assert_eq!(missing, "cannot read none.pem: No such file or directory (os error 2)");
}
