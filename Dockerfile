# docker build -t cohaptic .
# docker run --rm cohaptic check scenarios
# docker run --rm --user "$(id -u):$(id -g)" --volume "$PWD/out:/out" cohaptic run scenarios/network/ideal.toml --out /out
FROM rust:1.88-slim-bookworm AS build
WORKDIR /source
COPY . .
RUN cargo build --release --locked --package cohaptic-cli

FROM debian:bookworm-slim
RUN useradd --create-home cohaptic
COPY --from=build /source/target/release/cohaptic /usr/local/bin/cohaptic
COPY --from=build /source/scenarios /home/cohaptic/scenarios
USER cohaptic
WORKDIR /home/cohaptic
ENTRYPOINT ["cohaptic"]
CMD ["--help"]
