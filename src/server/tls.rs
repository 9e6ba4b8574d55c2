//! TLS, where a certificate is set.

use std::path::Path;
use std::sync::Arc;

use tokio_rustls::TlsAcceptor;
use tokio_rustls::rustls::ServerConfig;
use tokio_rustls::rustls::crypto::ring;
use tokio_rustls::rustls::pki_types::pem::PemObject;
use tokio_rustls::rustls::pki_types::{CertificateDer, PrivateKeyDer};

use crate::server::config::Config;

/// The acceptor of the settings, if they ask for one.
///
/// # Errors
/// One file without the other; files that cannot be read or do not fit each other.
pub fn acceptor(config: &Config) -> Result<Option<TlsAcceptor>, String> {
    let (chain, key) = match (&config.tls_cert, &config.tls_key) {
        (None, None) => return Ok(None),
        (Some(chain), Some(key)) => (chain, key),
        _ => {
            return Err(
                "the settings `tls-cert` and `tls-key` go together: one of them is missing".into(),
            );
        }
    };
    let within = |what: &str, path: &Path, error: &dyn std::fmt::Display| {
        format!("the setting `{what}`, {}: {error}", path.display())
    };
    let certificates =
        CertificateDer::pem_file_iter(chain).and_then(Iterator::collect::<Result<Vec<_>, _>>);
    let certificates = certificates.map_err(|error| within("tls-cert", chain, &error))?;
    let private =
        PrivateKeyDer::from_pem_file(key).map_err(|error| within("tls-key", key, &error))?;
    let builder = ServerConfig::builder_with_provider(Arc::new(ring::default_provider()))
        .with_safe_default_protocol_versions();
    let builder = builder.map_err(|error| within("tls-cert", chain, &error))?.with_no_client_auth();
    let mut server = builder
        .with_single_cert(certificates, private)
        .map_err(|error| within("tls-cert", chain, &error))?;
    server.alpn_protocols = vec![b"http/1.1".to_vec()];
    Ok(Some(TlsAcceptor::from(Arc::new(server))))
}
