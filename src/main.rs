//! The `canopy` program: see [`cli`].

mod cli;

fn main() -> std::process::ExitCode {
    #[cfg(feature = "tracy")]
    {
        use tracing_subscriber::layer::SubscriberExt;
        use tracing_subscriber::util::SubscriberInitExt;
        // Fails only where a subscriber is set already, and none is.
        let _ = tracing_subscriber::registry().with(tracing_tracy::TracyLayer::default()).try_init();
    }
    cli::run()
}
