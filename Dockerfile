# Build: docker build -t springline .
# Run:   docker run --rm -p 8080:8080 --read-only --cap-drop all springline
# With podman or buildah: scripts/build-image. scripts/check-image builds the image and checks it.
#
# With default settings, large requests need more than 64 MiB. To run in 64 MiB:
# --memory 64m --env-file deploy/64-mib.env

# The full name, for builders that ask which registry a short name means.
ARG BUILDER=docker.io/library/rust:1.95-bookworm

FROM ${BUILDER} AS build
WORKDIR /src
COPY Cargo.toml Cargo.lock ./
COPY src src
COPY openapi openapi
# glibc is linked in, so the binary needs no file of the image. It resolves a name only for
# --otlp-endpoint. Static glibc can do that with /etc/hosts and DNS; the linker warns anyway.
#
# Without symbols it is 2 MB smaller; a panic still says in which file and line it was.
#
# The caches outlive this build and may come from another checkout. Cargo compares times and could
# take old artifacts for newer than these sources. `touch` makes the sources newer.
RUN --mount=type=cache,target=/usr/local/cargo/registry,sharing=locked \
    --mount=type=cache,id=springline-target,target=/src/target,sharing=locked \
    touch src/lib.rs src/main.rs \
    && host=$(rustc -vV | sed -n 's/^host: //p') \
    && CARGO_PROFILE_RELEASE_STRIP=symbols RUSTFLAGS="-C target-feature=+crt-static" cargo build --release --locked --target "$host" \
    && cp "target/$host/release/springline" /springline

FROM scratch
LABEL org.opencontainers.image.title="springline" \
      org.opencontainers.image.description="Curves with shape parameters, over HTTP" \
      org.opencontainers.image.licenses="MIT OR Apache-2.0"
COPY --from=build /springline /springline
# A number, so that an orchestrator can see that the user is not root.
USER 65532:65532
# Huge pages would take 10 MiB more when the service is idle.
ENV SPRINGLINE_LISTEN=0.0.0.0:8080 MIMALLOC_ALLOW_THP=0
EXPOSE 8080
STOPSIGNAL SIGTERM
HEALTHCHECK --interval=10s --timeout=3s CMD ["/springline", "healthcheck"]
ENTRYPOINT ["/springline"]
CMD ["serve"]
