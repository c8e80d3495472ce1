//! Mutual authentication of both ends of a link by a shared secret.
//!
//! An Ed25519 key is derived from the secret, and a self-signed certificate from the key: the same on both ends. In TLS 1.3 each end
//! proves that it has the key; the verifier here accepts this one certificate only (certificate pinning).

use crate::error::{Error, LinkError};
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

/// Name in the certificate; it is not checked.
const NAME: &str = "palpate";

/// Shortest secret [bytes].
const MIN_SECRET: usize = 12;

/// Prefix that makes a seed an Ed25519 key in PKCS #8 (RFC 8410).
const ED25519_PKCS8: [u8; 16] =
    [0x30, 0x2e, 0x02, 0x01, 0x00, 0x30, 0x05, 0x06, 0x03, 0x2b, 0x65, 0x70, 0x04, 0x22, 0x04, 0x20];

/// Secret that both ends of a link share.
#[derive(Clone, Default, PartialEq, Eq)]
pub struct Secret(Vec<u8>);

impl fmt::Debug for Secret {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Secret(…)")
    }
}

impl Secret {
    /// Secret from a text, without surrounding white space.
    ///
    /// # Errors
    /// If it has less than 12 bytes, and could be guessed.
    pub fn new(text: &str) -> Result<Self, Error> {
        let text = text.trim();
        if text.len() < MIN_SECRET {
            return Err(LinkError::SecretTooShort { bytes: text.len() }.into());
        }
        Ok(Self(text.as_bytes().to_vec()))
    }

    /// Empty secret, for processes on one machine.
    pub fn none() -> Self {
        Self::default()
    }

    /// Refuses an address that other machines can reach, if the secret is empty.
    pub(super) fn check(&self, address: IpAddr) -> Result<(), Error> {
        if self.0.is_empty() && !address.is_loopback() {
            return Err(LinkError::SecretRequired { address }.into());
        }
        Ok(())
    }

    fn identity(&self) -> Result<Identity, Error> {
        let failed = |error: rcgen::Error| LinkError::Certificate { reason: error.to_string() };
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
            verifier: Arc::new(PinnedCertificate { certificate, provider }),
        })
    }

    /// TLS settings of the server.
    pub(super) fn server(&self) -> Result<rustls::ServerConfig, Error> {
        let Identity { certificate, key, verifier } = self.identity()?;
        let config = rustls::ServerConfig::builder_with_provider(verifier.provider.clone())
            .with_protocol_versions(&[&rustls::version::TLS13])
            .and_then(|builder| {
                builder.with_client_cert_verifier(verifier).with_single_cert(vec![certificate], key)
            });
        let mut config = config.map_err(|error| LinkError::Encryption { reason: error.to_string() })?;
        config.alpn_protocols = vec![PROTOCOL.to_vec()];
        Ok(config)
    }

    /// TLS settings of the client.
    pub(super) fn client(&self) -> Result<rustls::ClientConfig, Error> {
        let Identity { certificate, key, verifier } = self.identity()?;
        let config = rustls::ClientConfig::builder_with_provider(verifier.provider.clone())
            .with_protocol_versions(&[&rustls::version::TLS13])
            .and_then(|builder| {
                builder
                    .dangerous()
                    .with_custom_certificate_verifier(verifier)
                    .with_client_auth_cert(vec![certificate], key)
            });
        let mut config = config.map_err(|error| LinkError::Encryption { reason: error.to_string() })?;
        config.alpn_protocols = vec![PROTOCOL.to_vec()];
        Ok(config)
    }
}

/// Protocol and version, negotiated by TLS (ALPN).
const PROTOCOL: &[u8] = b"palpate-link/1";

/// Certificate and key of both ends, with the verifier of the other end's.
struct Identity {
    certificate: CertificateDer<'static>,
    key: PrivateKeyDer<'static>,
    verifier: Arc<PinnedCertificate>,
}

/// Verifier that accepts one certificate only, from an end that has its key.
#[derive(Debug)]
struct PinnedCertificate {
    certificate: CertificateDer<'static>,
    provider: Arc<CryptoProvider>,
}

impl PinnedCertificate {
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

    /// Refuses TLS 1.2, which is not offered.
    fn refuse(&self) -> Result<HandshakeSignatureValid, rustls::Error> {
        Err(rustls::Error::General("TLS 1.3 only".to_string()))
    }
}

impl ServerCertVerifier for PinnedCertificate {
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

impl ClientCertVerifier for PinnedCertificate {
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
