# Build: docker build -t springline .
# Run:   docker run --rm -p 8080:8080 --read-only --cap-drop all springline

ARG BUILDER=rust:1.95-bookworm

FROM ${BUILDER} AS build
WORKDIR /src
COPY Cargo.toml Cargo.lock ./
COPY src src
COPY openapi openapi
# glibc linked in: the binary needs no file of the image. It resolves no names, so nothing is missed.
RUN --mount=type=cache,target=/usr/local/cargo/registry \
    --mount=type=cache,target=/src/target \
    host=$(rustc -vV | sed -n 's/^host: //p') \
    && RUSTFLAGS="-C target-feature=+crt-static" cargo build --release --locked --target "$host" \
    && cp "target/$host/release/springline" /springline

FROM scratch
LABEL org.opencontainers.image.title="springline" \
      org.opencontainers.image.description="Curves with shape parameters, over HTTP" \
      org.opencontainers.image.licenses="MIT OR Apache-2.0"
COPY --from=build /springline /springline
USER 65532:65532
ENV SPRINGLINE_LISTEN=0.0.0.0:8080
EXPOSE 8080
STOPSIGNAL SIGTERM
HEALTHCHECK --interval=10s --timeout=3s CMD ["/springline", "healthcheck"]
ENTRYPOINT ["/springline"]
CMD ["serve"]
