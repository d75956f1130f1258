//! A connection to a NATS server with JetStream.

use std::future::Future;
use std::time::Duration;

use anyhow::{Context as _, Result};
use async_nats::jetstream::{self, Context};
use async_nats::{Client, ServerAddr};
use tokio::runtime::{Builder, Runtime};

use super::access::Access;

/// How long a server may take to answer.
const PATIENCE: Duration = Duration::from_secs(5);

/// A connection that comes back by itself when the server does.
pub struct Server {
    runtime: Runtime,
    /// To send and to hear.
    pub client: Client,
    pub context: Context,
    /// As it may be printed.
    pub name: String,
}

impl Server {
    ///
    /// # Errors
    /// One sentence if there is no server, if it wants other credentials, or if it is not who it should be.
    pub fn connect(address: &str, access: &Access) -> Result<Self> {
        let name = shown(address);
        let runtime = Builder::new_multi_thread().worker_threads(1).enable_all().build()?;
        let options = access.options()?;
        let connected = runtime.block_on(async {
            let options = options.name("rotor-edge-plant").connection_timeout(PATIENCE);
            let server: ServerAddr = address.parse()?;
            let options = match (server.username(), server.password()) {
                (Some(name), Some(password)) => options.user_and_password(name.into(), password.into()),
                _ => options,
            };
            let client = options.connect(server).await?;
            let mut context = jetstream::new(client.clone());
            context.set_timeout(PATIENCE);
            anyhow::Ok((client, context))
        });
        let (client, context) = connected.with_context(|| refused(&name))?;
        Ok(Self { runtime, client, context, name })
    }

    /// What comes of it, waited for.
    pub fn wait<T>(&self, work: impl Future<Output = T>) -> T {
        self.runtime.block_on(work)
    }

    /// Goes on with it beside everything else, as long as the connection lives.
    pub fn spawn(&self, work: impl Future<Output = ()> + Send + 'static) {
        self.runtime.spawn(work);
    }
}

/// Why nothing can be done with a server.
pub fn refused(name: &str) -> String {
    format!("{name}: no NATS server with JetStream that lets us in")
}

/// An address as it may be printed: without the name and the password that may be in it.
fn shown(address: &str) -> String {
    match (address.split_once("://"), address.rsplit_once('@')) {
        (Some((scheme, _)), Some((_, host))) => format!("{scheme}://{host}"),
        (None, Some((_, host))) => host.into(),
        _ => address.into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_password_is_not_shown() {
        assert_eq!(shown("nats://gateway:s3c@ret@10.0.0.1:4222"), "nats://10.0.0.1:4222");
        assert_eq!(shown("nats://10.0.0.1:4222"), "nats://10.0.0.1:4222");
    }
}
