//! Both ends of a link prove to each other that they know one secret.
//!
//! An Ed25519 key is derived from the secret, and one certificate from the key: the same on both ends. TLS 1.3 lets each end
//! prove that it has the key; here it is checked that the certificate is the own one.

use crate::error::Error;
use quinn::rustls;
use rcgen::{CertificateParams, KeyPair, SerialNumber};
use rustls::client::danger::{HandshakeSignatureValid, ServerCertVerified, ServerCertVerifier};
use rustls::crypto::{CryptoProvider, aws_lc_rs, verify_tls13_signature};
use rustls::pki_types::{CertificateDer, PrivateKeyDer, PrivatePkcs8KeyDer, ServerName, UnixTime};
use rustls::server::danger::{ClientCertVerified, ClientCertVerifier};
use rustls::{CertificateError, DigitallySignedStruct, DistinguishedName, SignatureScheme};
use std::fmt;
use std::net::IpAddr;
use std::sync::Arc;

/// The name in the certificate; nobody looks at it.
const NAME: &str = "palpate";

/// Shortest secret between machines, in bytes.
const SHORTEST: usize = 12;

/// Before a seed, an Ed25519 key in PKCS #8 (RFC 8410).
const ED25519_PKCS8: [u8; 16] =
    [0x30, 0x2e, 0x02, 0x01, 0x00, 0x30, 0x05, 0x06, 0x03, 0x2b, 0x65, 0x70, 0x04, 0x22, 0x04, 0x20];

/// What both ends of a link know.
#[derive(Clone, Default, PartialEq, Eq)]
pub struct Secret(Vec<u8>);

impl fmt::Debug for Secret {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Secret(…)")
    }
}

impl Secret {
    /// From a text, without the white space around it.
    ///
    /// # Errors
    /// When it is short enough to be guessed.
    pub fn new(text: &str) -> Result<Self, Error> {
        let text = text.trim();
        if text.len() < SHORTEST {
            return Err(Error::Setup(format!(
                "the secret has {} bytes, expected at least {SHORTEST}: `openssl rand -hex 16` makes a good one",
                text.len()
            )));
        }
        Ok(Self(text.as_bytes().to_vec()))
    }

    /// None: for processes on one machine.
    pub fn none() -> Self {
        Self::default()
    }

    /// Refuse an address that others can reach without a secret.
    pub(super) fn check(&self, address: IpAddr) -> Result<(), Error> {
        if self.0.is_empty() && !address.is_loopback() {
            return Err(Error::Setup(format!(
                "{address} is reached from other machines: a link there needs a secret"
            )));
        }
        Ok(())
    }

    fn identity(&self) -> Result<Identity, Error> {
        let failed =
            |error: rcgen::Error| Error::Setup(format!("no certificate can be made for the link: {error}"));
        let seed = blake3::derive_key("palpate 2026-11-22 link identity v1", &self.0);
        let key = PrivatePkcs8KeyDer::from([&ED25519_PKCS8[..], &seed].concat());
        let pair = KeyPair::try_from(&key).map_err(failed)?;
        let mut parameters = CertificateParams::new(vec![NAME.to_string()]).map_err(failed)?;
        parameters.serial_number = Some(SerialNumber::from(1_u64));
        let certificate = parameters.self_signed(&pair).map_err(failed)?.der().clone();
        let provider = Arc::new(aws_lc_rs::default_provider());
        Ok(Identity {
            certificate: certificate.clone(),
            key: key.into(),
            same: Arc::new(Same { certificate, provider }),
        })
    }

    /// The force process's side.
    pub(super) fn server(&self) -> Result<rustls::ServerConfig, Error> {
        let Identity { certificate, key, same } = self.identity()?;
        let config = rustls::ServerConfig::builder_with_provider(same.provider.clone())
            .with_protocol_versions(&[&rustls::version::TLS13])
            .and_then(|builder| {
                builder.with_client_cert_verifier(same).with_single_cert(vec![certificate], key)
            });
        let mut config =
            config.map_err(|error| Error::Setup(format!("the link can't be encrypted: {error}")))?;
        config.alpn_protocols = vec![PROTOCOL.to_vec()];
        Ok(config)
    }

    /// The device's side.
    pub(super) fn client(&self) -> Result<rustls::ClientConfig, Error> {
        let Identity { certificate, key, same } = self.identity()?;
        let config = rustls::ClientConfig::builder_with_provider(same.provider.clone())
            .with_protocol_versions(&[&rustls::version::TLS13])
            .and_then(|builder| {
                builder
                    .dangerous()
                    .with_custom_certificate_verifier(same)
                    .with_client_auth_cert(vec![certificate], key)
            });
        let mut config =
            config.map_err(|error| Error::Setup(format!("the link can't be encrypted: {error}")))?;
        config.alpn_protocols = vec![PROTOCOL.to_vec()];
        Ok(config)
    }
}

/// The protocol and its version, as TLS negotiates it.
const PROTOCOL: &[u8] = b"palpate-link/1";

struct Identity {
    certificate: CertificateDer<'static>,
    key: PrivateKeyDer<'static>,
    same: Arc<Same>,
}

/// Accepts the own certificate only, from who has its key.
#[derive(Debug)]
struct Same {
    certificate: CertificateDer<'static>,
    provider: Arc<CryptoProvider>,
}

impl Same {
    fn check(&self, other: &CertificateDer<'_>) -> Result<(), rustls::Error> {
        let same = *other == self.certificate;
        same.then_some(()).ok_or(CertificateError::ApplicationVerificationFailure.into())
    }

    fn verify(
        &self,
        message: &[u8],
        certificate: &CertificateDer<'_>,
        signed: &DigitallySignedStruct,
    ) -> Result<HandshakeSignatureValid, rustls::Error> {
        verify_tls13_signature(message, certificate, signed, &self.provider.signature_verification_algorithms)
    }

    /// TLS 1.2 is not offered.
    fn refuse(&self) -> Result<HandshakeSignatureValid, rustls::Error> {
        Err(rustls::Error::General("TLS 1.3 only".to_string()))
    }
}

impl ServerCertVerifier for Same {
    fn verify_server_cert(
        &self,
        certificate: &CertificateDer<'_>,
        _: &[CertificateDer<'_>],
        _: &ServerName<'_>,
        _: &[u8],
        _: UnixTime,
    ) -> Result<ServerCertVerified, rustls::Error> {
        self.check(certificate).map(|()| ServerCertVerified::assertion())
    }

    fn verify_tls12_signature(
        &self,
        _: &[u8],
        _: &CertificateDer<'_>,
        _: &DigitallySignedStruct,
    ) -> Result<HandshakeSignatureValid, rustls::Error> {
        self.refuse()
    }

    fn verify_tls13_signature(
        &self,
        message: &[u8],
        certificate: &CertificateDer<'_>,
        signed: &DigitallySignedStruct,
    ) -> Result<HandshakeSignatureValid, rustls::Error> {
        self.verify(message, certificate, signed)
    }

    fn supported_verify_schemes(&self) -> Vec<SignatureScheme> {
        vec![SignatureScheme::ED25519]
    }
}

impl ClientCertVerifier for Same {
    fn root_hint_subjects(&self) -> &[DistinguishedName] {
        &[]
    }

    fn verify_client_cert(
        &self,
        certificate: &CertificateDer<'_>,
        _: &[CertificateDer<'_>],
        _: UnixTime,
    ) -> Result<ClientCertVerified, rustls::Error> {
        self.check(certificate).map(|()| ClientCertVerified::assertion())
    }

    fn verify_tls12_signature(
        &self,
        _: &[u8],
        _: &CertificateDer<'_>,
        _: &DigitallySignedStruct,
    ) -> Result<HandshakeSignatureValid, rustls::Error> {
        self.refuse()
    }

    fn verify_tls13_signature(
        &self,
        message: &[u8],
        certificate: &CertificateDer<'_>,
        signed: &DigitallySignedStruct,
    ) -> Result<HandshakeSignatureValid, rustls::Error> {
        self.verify(message, certificate, signed)
    }

    fn supported_verify_schemes(&self) -> Vec<SignatureScheme> {
        vec![SignatureScheme::ED25519]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_secret_makes_one_certificate_and_another_another() {
        let of = |text: &str| {
            Secret::new(text).and_then(|secret| secret.identity()).expect("an identity").certificate
        };
        assert_eq!(of("correct horse battery"), of(" correct horse battery\n"));
        assert_ne!(of("correct horse battery"), of("correct horse battery staple"));
        let short = Secret::new("hunter2").expect_err("too short").to_string();
        assert!(short.starts_with("the secret has 7 bytes"), "{short}");
        assert_eq!(format!("{:?}", Secret::none()), "Secret(…)");
    }
}
