# rio_t with ROS Noetic (Ubuntu 20.04), built and tested in a catkin workspace. From the folder of the repository:
#   docker build -f docker/noetic.Dockerfile -t rio_t:noetic .
#   docker run --rm -v $PWD:/data -w /data rio_t:noetic rosrun rio_t rio_t_bag run.bag --config irs --output-dir out
FROM ros:noetic
SHELL ["/bin/bash", "-c"]
ENV DEBIAN_FRONTEND=noninteractive

# The dependencies first: this layer stays as long as package.xml does.
COPY package.xml /workspace/src/rio_t/
RUN apt-get update && rosdep update --include-eol-distros && \
    rosdep install --from-paths /workspace/src --ignore-src --rosdistro noetic -y && rm -rf /var/lib/apt/lists/*

COPY . /workspace/src/rio_t
COPY docker/in_workspace.sh /
RUN source /opt/ros/noetic/setup.bash && /workspace/src/rio_t/docker/build_workspace.sh /workspace
ENTRYPOINT ["/in_workspace.sh"]
CMD ["bash"]
