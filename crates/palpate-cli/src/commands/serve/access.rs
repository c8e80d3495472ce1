//! Access to the viewer's server: its address, token, certificate and limits.

use crate::failure::Failure;
use crate::interrupt::stop_on_interrupt;
use crate::secret_file::read_secret_file;
use crate::terminal::notify;
use clap::Args;
use palpate_viewer::{FrameAncestor, Limits, ServedContent, Server, Settings, TlsIdentity, Token};
use std::net::{Ipv4Addr, SocketAddr};
use std::path::PathBuf;
use std::process::{Command, Stdio};

/// Default port.
const PORT: u16 = 7400;

/// Environment variable with the token.
const TOKEN_VARIABLE: &str = "PALPATE_TOKEN";

/// Options of the access to the server.
#[derive(Args, Debug, Clone, Default)]
pub struct AccessOptions {
    /// Address and port of the page [default: 127.0.0.1:7400, or a free port if that is taken]
    #[arg(long, value_name = "ADDRESS:PORT")]
    listen: Option<SocketAddr>,
    /// File with the token that everybody needs who opens the page; or set PALPATE_TOKEN [default beyond this machine: a random
    /// one]
    #[arg(long, value_name = "FILE")]
    token_file: Option<PathBuf>,
    /// The token itself, which everybody on this machine can read there: rather --token-file
    #[arg(long, value_name = "TEXT", conflicts_with = "token_file")]
    token: Option<String>,
    /// Certificate of the server, with those that sign it (PEM): the connection is encrypted (https)
    #[arg(long, value_name = "FILE", requires = "tls_key")]
    tls_cert: Option<PathBuf>,
    /// Key of the certificate (PEM)
    #[arg(long, value_name = "FILE", requires = "tls_cert")]
    tls_key: Option<PathBuf>,
    /// Connections at a time; a page has up to seven [default: 256]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=65536))]
    max_connections: Option<u32>,
    /// Origin of a page that may show this one in a frame, as http://localhost:8888, or http://localhost:* for any port; can be
    /// given several times [default: none may]
    #[arg(long = "frame-ancestor", value_name = "ORIGIN")]
    frame_ancestors: Vec<FrameAncestor>,
    /// Do not open a browser
    #[arg(long)]
    no_browser: bool,
}

/// Server that is bound, with the address to open.
pub struct BoundServer {
    server: Server,
    address: String,
    opens_browser: bool,
}

impl AccessOptions {
    /// Binds the given address, or the default port, or a free one.
    pub fn bind(&self) -> Result<BoundServer, Failure> {
        let failed = |error: &dyn std::fmt::Display| Failure(error.to_string());
        let listen = self.listen.unwrap_or((Ipv4Addr::LOCALHOST, PORT).into());
        let beyond = !listen.ip().is_loopback();
        let token = match self.given_token()? {
            None if beyond => Some(Token::generate().map_err(|error| failed(&error))?),
            given => given,
        };
        let tls = match (&self.tls_cert, &self.tls_key) {
            (Some(certificate), Some(key)) => {
                Some(TlsIdentity::read(certificate, key).map_err(|error| failed(&error))?)
            }
            _ => None,
        };
        let limits = match self.max_connections {
            Some(connections) => Limits { connections: connections as usize, ..Limits::default() },
            None => Limits::default(),
        };
        let frame_ancestors = self.frame_ancestors.clone();
        let settings =
            Settings { token: token.clone(), tls, limits, frame_ancestors, ..Settings::new(listen) };
        let server = match (Server::bind(&settings), self.listen) {
            (Err(_), None) => {
                Server::bind(&Settings { listen: (Ipv4Addr::LOCALHOST, 0).into(), ..settings.clone() })
            }
            (bound, _) => bound,
        };
        let server = server.map_err(|error| failed(&error))?;
        let scheme = if settings.tls.is_some() { "https" } else { "http" };
        if beyond && settings.tls.is_none() {
            notify(
                "warning: the connection is not encrypted: who is on the way to this machine can read the token, and act with \
                 it; give a certificate (--tls-cert, --tls-key), or listen on 127.0.0.1 behind an SSH tunnel",
            );
        }
        let query = token.as_ref().map_or(String::new(), |token| format!("?{}", token.query()));
        let address = format!("{scheme}://{}/{query}", server.address().map_err(|error| failed(&error))?);
        // The command line of a browser can be read by everybody on this machine.
        let opens_browser = !self.no_browser && token.is_none();
        Ok(BoundServer { server, address, opens_browser })
    }

    /// Token of the file, the option or the environment.
    fn given_token(&self) -> Result<Option<Token>, Failure> {
        let (source, text) = if let Some(file) = &self.token_file {
            (file.display().to_string(), read_secret_file("the token", file)?)
        } else if let Some(text) = &self.token {
            notify(&format!(
                "warning: everybody on this machine can read --token (ps): use --token-file, or {TOKEN_VARIABLE}"
            ));
            ("--token".into(), text.clone())
        } else if let Some(text) = std::env::var_os(TOKEN_VARIABLE) {
            let text =
                text.into_string().map_err(|_| Failure(format!("{TOKEN_VARIABLE} is not UTF-8 text")))?;
            (TOKEN_VARIABLE.into(), text)
        } else {
            return Ok(None);
        };
        Token::new(&text).map(Some).map_err(|error| Failure(format!("{source}: {error}")))
    }
}

impl BoundServer {
    /// Prints the address, opens a browser, and serves until Ctrl-C.
    pub fn serve(self, content: ServedContent) -> Result<(), Failure> {
        // Before the address is printed: its reader may interrupt at once.
        let stop = stop_on_interrupt();
        notify(&format!("open {} in a browser (Ctrl-C ends it)", self.address));
        if self.opens_browser {
            open_browser(&self.address);
        }
        let warn = |text: &str| notify(&format!("warning: {text}"));
        self.server.run(content, stop, &warn).map_err(|error| Failure(error.to_string()))
    }
}

/// Opens a browser where there is a screen.
fn open_browser(address: &str) {
    let screen = ["DISPLAY", "WAYLAND_DISPLAY"].iter().any(|name| std::env::var_os(name).is_some());
    let program = if cfg!(target_os = "macos") { "open" } else { "xdg-open" };
    if screen || cfg!(target_os = "macos") {
        let quiet = Command::new(program).arg(address).stdout(Stdio::null()).stderr(Stdio::null()).spawn();
        // The address is printed: a browser can be opened by hand.
        drop(quiet);
    }
}
