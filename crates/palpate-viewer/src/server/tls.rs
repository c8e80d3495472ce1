//! TLS by a given certificate.

use crate::error::TlsError;
use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use tokio_rustls::TlsAcceptor;
use tokio_rustls::rustls::crypto::aws_lc_rs;
use tokio_rustls::rustls::pki_types::pem::{Error as PemError, PemObject};
use tokio_rustls::rustls::pki_types::{CertificateDer, PrivateKeyDer};
use tokio_rustls::rustls::{ServerConfig, version::TLS13};

/// Certificate chain and key of the server.
#[derive(Clone)]
pub struct TlsIdentity(TlsAcceptor);

impl fmt::Debug for TlsIdentity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("TlsIdentity(…)")
    }
}

impl TlsIdentity {
    /// Identity from PEM files: the certificate with those that sign it, and its key.
    ///
    /// # Errors
    /// If a file cannot be read, or the key is not of the certificate.
    pub fn read(certificate: &Path, key: &Path) -> Result<Self, TlsError> {
        let unreadable = |path: &Path| {
            let path: PathBuf = path.into();
            move |error| match error {
                PemError::Io(error) => TlsError::Unreadable { path: path.clone(), reason: error.to_string() },
                error => TlsError::NoPem { path: path.clone(), reason: error.to_string() },
            }
        };
        let failed = unreadable(certificate);
        let chain = CertificateDer::pem_file_iter(certificate)
            .and_then(Iterator::collect::<Result<Vec<_>, _>>)
            .map_err(failed)?;
        if chain.is_empty() {
            return Err(TlsError::NoCertificate(certificate.into()));
        }
        let private = PrivateKeyDer::from_pem_file(key).map_err(unreadable(key))?;
        let refused = |error: tokio_rustls::rustls::Error| TlsError::Refused {
            certificate: certificate.into(),
            key: key.into(),
            reason: error.to_string(),
        };
        let mut config = ServerConfig::builder_with_provider(Arc::new(aws_lc_rs::default_provider()))
            .with_protocol_versions(&[&TLS13])
            .and_then(|builder| builder.with_no_client_auth().with_single_cert(chain, private))
            .map_err(refused)?;
        config.alpn_protocols = vec![b"http/1.1".to_vec()];
        Ok(Self(TlsAcceptor::from(Arc::new(config))))
    }

    /// Acceptor of connections.
    pub(super) fn acceptor(&self) -> &TlsAcceptor {
        &self.0
    }
}
