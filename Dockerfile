# docker build --tag sealtwin . && docker run --rm --volume "$PWD:/trials" sealtwin demo
FROM python:3.12-slim
COPY . /sealtwin
RUN pip install --no-cache-dir /sealtwin --constraint /sealtwin/constraints.txt
WORKDIR /trials
ENTRYPOINT ["sealtwin"]
