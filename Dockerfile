# Two images from the packages of uv.lock. The first has all of Khala, with the simulator in /opt/StarCraftII;
# the second has only the agents, without any game.
#
#     docker build -t khala .                          docker run --rm khala run 2s3z_pair
#     docker build -t khala-agents --target agents .   docker run --rm khala-agents Stalkers --run first --connect …
#
# Nodes of a Ray cluster need Ray as well: docker build --build-arg EXTRAS="--extra ray" -t khala-ray .
# Any image with Python 3.11, 3.12 or 3.13, pip and glibc works: docker build --build-arg PYTHON_IMAGE=…
ARG PYTHON_IMAGE=python:3.12-slim

FROM ${PYTHON_IMAGE} AS source
RUN pip install --no-cache-dir --disable-pip-version-check 'uv==0.13.9'
ENV UV_PROJECT_ENVIRONMENT=/opt/khala \
    UV_PYTHON_DOWNLOADS=never \
    UV_COMPILE_BYTECODE=1 \
    UV_LINK_MODE=copy \
    UV_CACHE_DIR=/var/cache/uv
WORKDIR /src
COPY . .

FROM source AS build-agents
RUN --mount=type=cache,target=/var/cache/uv uv sync --frozen --no-dev --no-editable --package khala-sc2-agents

FROM source AS build-all
ARG EXTRAS=""
# For the simulator's compiled systems; without them it plays, several times slower.
RUN command -v cc || { apt-get update && apt-get install -y --no-install-recommends gcc libc6-dev; }
RUN --mount=type=cache,target=/var/cache/uv uv sync --frozen --no-dev --no-editable ${EXTRAS} \
    && /opt/khala/bin/khala sc2 install /opt/StarCraftII

FROM ${PYTHON_IMAGE} AS base
# /runs is writable for every user that a container may run as, and so is a new volume that is mounted there.
RUN useradd --uid 1000 --user-group --create-home khala && install --directory --mode=1777 /runs
ENV PATH=/opt/khala/bin:$PATH \
    PYTHONUNBUFFERED=1 \
    MPLCONFIGDIR=/tmp
WORKDIR /home/khala
CMD ["--help"]

FROM base AS agents
COPY --from=build-agents /opt/khala /opt/khala
USER 1000:1000
ENTRYPOINT ["khala-agent"]

FROM base AS khala
COPY --from=build-all /opt /opt
ENV SC2PATH=/opt/StarCraftII
USER 1000:1000
ENTRYPOINT ["khala"]
