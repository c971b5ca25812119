//! What can go wrong between a scene and a GPU: what was asked, what was found, what is allowed.

use sdfrs_core::SceneError;

#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum GpuError {
    /// Nothing suitable to run on.
    #[error("no GPU: asked for {asked}, found {found}; {advice}")]
    NoAdapter { asked: String, found: String, advice: &'static str },
    /// The adapter cannot hold or do as much as was asked.
    #[error("{what}: asked for {asked}, allowed on this adapter: {allowed}")]
    Limits { what: String, asked: u64, allowed: u64 },
    #[error("out of GPU memory: {what}, {bytes} bytes")]
    OutOfMemory { what: String, bytes: u64 },
    /// The driver gave the device up; the next request makes a new one.
    #[error("the GPU was lost ({reason}); a new call opens it again")]
    Lost { reason: String },
    /// The process is a fork of one that had used the GPU.
    #[error(
        "the GPU was opened before this process was forked from {parent}, and drivers don't survive a fork; \
         start workers by `spawn`, or open the GPU in the worker first"
    )]
    Forked { parent: u32 },
    #[error("the GPU did not answer within {seconds} s: {what}")]
    Timeout { what: String, seconds: u64 },
    /// A fault of ours or of the driver's compiler.
    #[error("the shader `{name}` was refused: {message}")]
    Shader { name: String, message: String },
    /// A fault of ours: the API refused a call.
    #[error("{what}: {message}")]
    Refused { what: String, message: String },
    #[error("cancelled")]
    Cancelled,
    #[error(transparent)]
    Scene(#[from] SceneError),
}
