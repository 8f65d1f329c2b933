# docker build -t cohaptic .
# docker run --rm cohaptic check scenarios
# mkdir -p out && docker run --rm --user "$(id -u):$(id -g)" --volume "$PWD/out:/out" cohaptic run scenarios/network/ideal.toml --out /out
FROM rust:1.88-slim-bookworm AS build
WORKDIR /source
COPY . .
RUN cargo build --release --locked --package cohaptic-cli

FROM debian:bookworm-slim
RUN useradd cohaptic
COPY --from=build /source/target/release/cohaptic /usr/local/bin/cohaptic
# Not in a home folder, which only its owner may read: `--user` names another one.
COPY --from=build /source/scenarios /cohaptic/scenarios
USER cohaptic
WORKDIR /cohaptic
ENTRYPOINT ["cohaptic"]
CMD ["--help"]
