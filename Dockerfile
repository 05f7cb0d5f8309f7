# Everything of Khala in one image: `khala`, the packages of uv.lock, and the simulator laid out in /opt/StarCraftII.
#
#     docker build -t khala .
#     docker run --rm khala run 2s3z_pair
#
# Any image with Python 3.11, 3.12 or 3.13 and pip on a glibc will do: docker build --build-arg PYTHON_IMAGE=…
ARG PYTHON_IMAGE=python:3.12-slim

FROM ${PYTHON_IMAGE} AS build
RUN pip install --no-cache-dir --disable-pip-version-check 'uv>=0.9'
ENV UV_PROJECT_ENVIRONMENT=/opt/khala \
    UV_PYTHON_DOWNLOADS=never \
    UV_COMPILE_BYTECODE=1 \
    UV_LINK_MODE=copy \
    UV_CACHE_DIR=/var/cache/uv
WORKDIR /src
# What changes rarely comes first: a change of our own code leaves the packages of others as they are.
COPY pyproject.toml uv.lock ./
RUN --mount=type=cache,target=/var/cache/uv uv sync --frozen --no-dev --no-install-project
COPY . .
RUN --mount=type=cache,target=/var/cache/uv uv sync --frozen --no-dev --no-editable \
    && /opt/khala/bin/khala sc2 install /opt/StarCraftII

FROM ${PYTHON_IMAGE}
# /runs is writable for whoever the container runs as, and so is a new volume that is mounted there.
RUN useradd --uid 1000 --user-group --create-home khala && install --directory --mode=1777 /runs
COPY --from=build /opt /opt
ENV PATH=/opt/khala/bin:$PATH \
    PYTHONUNBUFFERED=1 \
    SC2PATH=/opt/StarCraftII
USER 1000:1000
WORKDIR /home/khala
ENTRYPOINT ["khala"]
CMD ["--help"]
