# docker build -t cohaptic .
# docker run --rm cohaptic check scenarios
# mkdir -p out && docker run --rm --user "$(id -u):$(id -g)" --volume "$PWD/out:/out" cohaptic run scenarios/network/ideal.toml --out /out
# `.ci/image` checks the second stage without Docker: its size, and that the program runs where nothing else is.
FROM rust:1.88-alpine AS build
# Rust builds for musl on Alpine: a static program. musl-dev has the object files with which the linker begins and ends a program.
RUN apk add --no-cache musl-dev
WORKDIR /source
COPY . .
RUN cargo build --profile dist --locked --package cohaptic-cli

FROM scratch
COPY --from=build /source/target/dist/cohaptic /usr/local/bin/cohaptic
# Not in a home folder, which only its owner may read: `--user` names another one.
COPY --from=build /source/scenarios /cohaptic/scenarios
COPY --from=build /source/LICENSE-MIT /source/LICENSE-APACHE /cohaptic/
# As a number, because an empty image has no list of users in which a name could be looked up.
USER 65534:65534
WORKDIR /cohaptic
ENTRYPOINT ["/usr/local/bin/cohaptic"]
CMD ["--help"]
